// Which services have lost their last instance without a word, so that whoever looks later finds a
// trace of it. Pure.
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
  /// What its last instance said of itself.
  fabric::InstanceIdentity last{};
  fabric::Time since{};
};

class LostServices {
 public:
  /// So long a loss is told of, as the page shows what is gone.
  static constexpr std::chrono::minutes kept{15};
  /// A stranger can announce any number.
  static constexpr std::size_t most_instances = 4'096;
  static constexpr std::size_t most_lost = 100;

  /// An instance came, or changed what it says of itself; true if its service was lost.
  bool on_ready(const fabric::InstanceIdentity& identity);
  /// What it said of itself; nullptr if nobody knows.
  [[nodiscard]] const fabric::InstanceIdentity* find(const fabric::InstanceId& instance) const {
    const auto found = instances_.find(instance);
    return found == instances_.end() ? nullptr : &found->second;
  }
  /// The service that is lost with it; nothing if others are there, or it left in order.
  std::optional<LostService> on_gone(const fabric::InstanceId& instance, Moment now);
  /// The UUIDs of those that are lost for too long to be told of.
  std::vector<std::string> on_time(Moment now);

 private:
  std::map<fabric::InstanceId, fabric::InstanceIdentity> instances_;
  /// By UUID: when that is forgotten.
  std::map<std::string, SteadyTime> lost_;
};

}  // namespace millrace::gateway::core
