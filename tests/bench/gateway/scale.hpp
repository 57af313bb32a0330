// How far it goes: one thing of a plant grown alone, one row for each size, and what gives way
// first.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace millrace::bench {

struct ScaleOptions {
  /// What grows: names of dimensions(); empty: each of them in turn.
  std::vector<std::string> of;
  /// Its sizes; empty: those of the dimension.
  std::vector<std::uint32_t> sizes;
  /// How long the processor time without calls is counted. Participants speak up every 8 s.
  std::uint32_t idle_seconds = 8;
};

/// What can be grown.
std::vector<std::string> dimensions();
/// All rows, each in a process of its own. True if each of them came to its end.
bool measure_scale(const ScaleOptions& options);
/// The row of the first size of the first dimension.
void measure_scale_row(const ScaleOptions& options);

}  // namespace millrace::bench
