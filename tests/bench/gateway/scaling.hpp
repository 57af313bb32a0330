// What more instances of one UUID do to its calls, beside raw Cyclone with as many peers.
#pragma once

#include <cstdint>
#include <vector>

namespace millrace::bench {

struct ScalingOptions {
  std::vector<std::uint32_t> instances{1, 4, 16, 64};
  /// The instances of a row are spread over at most so many, and the raw peers too.
  std::uint32_t processes = 4;
  /// Of each row, in turns with raw Cyclone; the best counts.
  std::uint32_t rounds = 3;
};

/// All rows, each in a process of its own. True if the goals are met.
bool measure_scaling(const ScalingOptions& options);
/// The one row of the first number of instances.
void measure_scaling_row(const ScalingOptions& options);

}  // namespace millrace::bench
