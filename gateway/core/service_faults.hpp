// What a gateway reports about services, kept for a while as alarms: their last instance
// disappeared without leaving, or their responses are errors. Pure.
//
//   if (lost.on_ready(identity)) clear(identity.uuid);
//   if (auto service = lost.on_gone(id, now)) raise(*service);
//   for (const std::string& uuid : lost.on_time(now)) clear(uuid);
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
#include "fabric/messages.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::core {

class LostServices {
 public:
  /// How long a loss is published; the page shows it as long.
  static constexpr std::chrono::minutes kept{15};
  /// A stranger can announce any number.
  static constexpr std::size_t most_instances = 4'096;
  static constexpr std::size_t most_lost = 100;

  /// An instance came, or changed its identity; true if its service was lost.
  bool on_ready(const fabric::InstanceIdentity& identity);
  /// The identity of the instance; nullptr if it is unknown.
  [[nodiscard]] const fabric::InstanceIdentity* find(const fabric::InstanceId& instance) const {
    const auto found = instances_.find(instance);
    return found == instances_.end() ? nullptr : &found->second;
  }
  /// The instance, if its service is lost with it; nothing if others are there, or it left in
  /// order.
  std::optional<fabric::InstanceIdentity> on_gone(const fabric::InstanceId& instance,
                                                  SteadyTime now);
  /// The UUIDs whose losses are too old to publish.
  std::vector<std::string> on_time(SteadyTime now);

 private:
  std::map<fabric::InstanceId, fabric::InstanceIdentity> instances_;
  /// By UUID: when that is forgotten.
  std::map<std::string, SteadyTime> lost_;
};

/// Services whose responses are errors, one after the other.
class ErrorSeries {
 public:
  /// So many errors without another response in between are a warning, and a problem. Our choice:
  /// an NC program may ask once for what there is not.
  static constexpr std::size_t warned_at = 3;
  static constexpr std::size_t problem_at = 10;
  /// How long the last error is published when no further response comes.
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
