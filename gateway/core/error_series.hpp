// Services whose answers are errors, one after the other. Pure.
//
//   if (const auto level = series.on_error(uuid, now)) raise(uuid, *level, series.length(uuid));
//   if (series.on_success(uuid)) clear(uuid);
//   for (const std::string& uuid : series.on_time(now)) clear(uuid);
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fabric/alarm.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::core {

class ErrorSeries {
 public:
  /// So many errors without another answer in between are a warning, and a problem. Our choice: an
  /// NC program may ask once for what there is not.
  static constexpr std::size_t warned_at = 3;
  static constexpr std::size_t problem_at = 10;
  /// How long the last error is published when no further answer comes.
  static constexpr std::chrono::minutes kept{15};
  /// A stranger can announce any number of services.
  static constexpr std::size_t most = 100;

  /// The new level of the service's alarm; nothing if it stays.
  std::optional<fabric::AlarmLevel> on_error(const std::string& uuid, SteadyTime now);
  /// True if the service had an alarm.
  bool on_success(const std::string& uuid);
  /// The services whose last error is too old to publish.
  std::vector<std::string> on_time(SteadyTime now);

  [[nodiscard]] bool empty() const { return series_.empty(); }
  [[nodiscard]] std::size_t length(const std::string& uuid) const;

 private:
  struct Series {
    std::size_t errors = 0;
    SteadyTime last{};
  };
  std::map<std::string, Series> series_;
};

}  // namespace millrace::gateway::core
