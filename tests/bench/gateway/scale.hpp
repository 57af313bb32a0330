// Scaling limits: one dimension of a plant grows alone, one row for each size, until the first
// bottleneck.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace millrace::bench {

struct ScaleOptions {
  /// The dimensions that grow: names of dimensions(); empty: each of them in turn.
  std::vector<std::string> of;
  /// Its sizes; empty: those of the dimension.
  std::vector<std::uint32_t> sizes;
  /// How long the processor time without calls is measured. Participants announce themselves every
  /// 8 s.
  std::uint32_t idle_seconds = 8;
};

/// The names of all dimensions.
std::vector<std::string> dimensions();
/// All rows, each in its own process. True if each of them finished.
bool measure_scale(const ScaleOptions& options);
/// The row of the first size of the first dimension.
void measure_scale_row(const ScaleOptions& options);

}  // namespace millrace::bench
