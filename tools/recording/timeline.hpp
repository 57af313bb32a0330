// One call over every hop, from the samples of gateway and service.
//
//   TimelineBuilder builder(call);
//   builder.add(entry);                      // any entry, in any order
//   const Timeline timeline = builder.build();
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

/// In the order a call takes them.
enum class Stage : std::uint8_t {
  seen,
  unserved,
  dispatched,
  received,
  started,
  interim,
  answered,
  replied,
  refused,
  lost,
  held,
  late,
  withdrawn,
  written,
};

/// "seen by the gateway", …
std::string_view name_of(Stage stage);

struct TimelineStep {
  Stage stage = Stage::seen;
  fabric::Time at{};
  std::uint32_t attempt = 0;
  /// By the clock of the service's host rather than the gateway's.
  bool by_service = false;
  /// The instance it concerns, or all zero.
  fabric::InstanceId instance{};
  /// Request or response text, if there is one.
  std::string text{};
  std::optional<std::uint32_t> withheld{};
  std::uint32_t state = 0;
  std::string detail{};
};

struct Timeline {
  fabric::CallId call{};
  fabric::ChannelKey key{};
  std::string uuid{};
  bool replayed = false;
  /// In the order in which they must have happened; where clocks differ, times are not.
  std::vector<TimelineStep> steps{};
  /// The smallest difference between the service's clock and the gateway's with which the order
  /// holds; zero if the times agree with it.
  std::chrono::nanoseconds clock_difference{};
};

class TimelineBuilder {
 public:
  explicit TimelineBuilder(fabric::CallId call);

  /// Entries of other calls are ignored.
  void add(const Entry& entry);
  /// Without steps if no sample of the call was recorded.
  [[nodiscard]] Timeline build() const;

 private:
  void add(const fabric::Request& request, const Entry& entry);
  void add(const fabric::Reply& reply, const Entry& entry);
  void add(const fabric::Event& event, const Entry& entry);
  /// Unless the same stage of the same attempt is known at the same time.
  void add(TimelineStep step);
  void order_service_steps(Timeline& timeline) const;

  Timeline found_;
};

}  // namespace millrace::tools::recording
