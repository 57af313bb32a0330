// Which requests a service handles in the thread that receives them, and which wait for the
// executor, which takes a whole burst and sends its replies together. Pure.
//
//   Burst burst;
//   if (burst.on_sample(now)) {            // in a receiving thread
//     handle();
//     burst.on_handled(now());
//   } else {
//     post.post();
//   }
#pragma once

#include <atomic>
#include <chrono>

#include "fabric/moment.hpp"

namespace millrace::fabric::endpoints {

/// A datagram for each reply costs as much as the rest of a short call, so replies of a burst share
/// one. A hand-over to the executor costs more than a single call, so that has none. From any
/// thread: Cyclone may receive in several.
class Burst {
 public:
  /// Two samples that arrive closer to each other than this belong to one burst: the receiving
  /// thread did not sleep in between, so a further one probably follows. A reply to a single call
  /// takes more than twice as long to lead to the next request.
  static constexpr std::chrono::microseconds pause{15};
  /// The first samples of a burst are handled at once: two calls at a time are no burst. After a
  /// burst of more, none of the next one is.
  static constexpr unsigned handled_at_once = 2;

  /// A sample came; Cyclone reports each, also if its datagram has more. True: handle it at once.
  bool on_sample(SteadyTime now) {
    if (now - last_.exchange(now) < pause) {
      ++before_;
    } else {
      after_long_ = before_.exchange(0) >= handled_at_once;
    }
    return !after_long_ && before_ < handled_at_once;
  }
  /// Handling ended now: its time does not count as a pause.
  void on_handled(SteadyTime now) { last_ = now; }

 private:
  std::atomic<SteadyTime> last_{};
  /// Samples of this burst before the last one.
  std::atomic<unsigned> before_ = 0;
  /// The burst before was a long one.
  std::atomic<bool> after_long_ = false;
};

}  // namespace millrace::fabric::endpoints
