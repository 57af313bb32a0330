// The effect of more instances of one UUID on its calls, compared with raw Cyclone with as many
// peers.
#pragma once

#include <cstdint>
#include <vector>

namespace millrace::bench {

struct ScalingOptions {
  std::vector<std::uint32_t> instances{1, 4, 16, 64};
  /// The instances of a row are spread over at most this many processes, and the raw peers too.
  std::uint32_t processes = 4;
  /// Rounds of each row, in turns with raw Cyclone; the best one counts.
  std::uint32_t rounds = 3;
};

/// All rows, each in its own process. True if the goals are met.
bool measure_scaling(const ScalingOptions& options);
/// One row: of the first number of instances.
void measure_scaling_row(const ScalingOptions& options);

}  // namespace millrace::bench
