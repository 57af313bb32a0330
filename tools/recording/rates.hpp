// The frequency of an event over the last seconds. Pure.
#pragma once

#include <chrono>
#include <deque>
#include <optional>

#include "fabric/messages.hpp"

namespace millrace::tools::recording {

/// Of one channel or service.
class Rate {
 public:
  /// Older events do not count.
  static constexpr std::chrono::seconds window{10};

  /// Something that took `duration` (none = not known) ended at `now`.
  void add(fabric::Time now, std::optional<std::chrono::nanoseconds> duration);

  /// Since the start.
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// Over the window, or since the first time if that is less ago.
  [[nodiscard]] double per_second(fabric::Time now) const;
  /// Of the durations in the window; none if there is none.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> mean(fabric::Time now) const;

 private:
  struct One {
    fabric::Time at;
    std::optional<std::chrono::nanoseconds> duration;
  };

  std::deque<One> recent_;
  fabric::Time first_{};
  std::uint64_t count_ = 0;
};

}  // namespace millrace::tools::recording
