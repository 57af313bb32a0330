// Services whose last instance disappeared without leaving, kept for a while as alarms. Pure.
//
//   if (lost.on_ready(identity)) clear(identity.uuid);
//   if (auto service = lost.on_gone(id, now)) raise(*service);
//   for (const std::string& uuid : lost.on_time(now)) clear(uuid);
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fabric/messages.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::core {

struct LostService {
  /// Canonical.
  std::string uuid{};
  /// The announced identity of its last instance.
  fabric::InstanceIdentity last{};
  fabric::Time since{};
};

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
  /// The service that is lost with it; nothing if others are there, or it left in order.
  std::optional<LostService> on_gone(const fabric::InstanceId& instance, Moment now);
  /// The UUIDs whose losses are too old to publish.
  std::vector<std::string> on_time(Moment now);

 private:
  std::map<fabric::InstanceId, fabric::InstanceIdentity> instances_;
  /// By UUID: when that is forgotten.
  std::map<std::string, SteadyTime> lost_;
};

}  // namespace millrace::gateway::core
