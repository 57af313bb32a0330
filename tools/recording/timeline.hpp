// One call over every hop, in the order in which its steps must have happened.
#pragma once

#include <vector>

#include "tools/recording/call.hpp"

namespace millrace::tools::recording {

struct Timeline {
  fabric::CallId call{};
  fabric::ChannelKey key{};
  std::string uuid{};
  bool replayed = false;
  /// Where clocks differ, their times are not in this order.
  std::vector<Step> steps{};
  /// The smallest difference between the service's clock and the gateway's with which the order
  /// holds; zero if the times agree with it.
  std::chrono::nanoseconds clock_difference{};
};

/// Steps without a time are left out.
Timeline timeline_of(const Call& call);

}  // namespace millrace::tools::recording
