// How often the gateway looks at a channel.
#pragma once

#include <chrono>

namespace millrace::gateway {

/// How often a channel is looked at. The defaults cost a controller 100 short reads a second for
/// each idle channel, and 100 requests a second for all of them if it knows sums.
struct Pace {
  /// Within `active_for` of an answer, when a program's next request is likely.
  std::chrono::milliseconds active{2};
  std::chrono::milliseconds active_for{1000};
  std::chrono::milliseconds idle{10};
  /// How often a pending request is read whole, to see texts change under the same state.
  std::chrono::milliseconds whole{500};
  /// After the controller refused something or did not answer in time.
  std::chrono::milliseconds retry{500};
  /// How old a look may be when REQUEST_STATE is cleared.
  std::chrono::milliseconds fresh{10};
  bool operator==(const Pace&) const = default;
};

}  // namespace millrace::gateway
