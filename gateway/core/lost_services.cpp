#include "gateway/core/lost_services.hpp"

#include <algorithm>

namespace millrace::gateway::core {

bool LostServices::on_ready(const fabric::InstanceIdentity& identity) {
  if (instances_.size() < most_instances || instances_.contains(identity.id)) {
    instances_.insert_or_assign(identity.id, identity);
  }
  return lost_.erase(identity.uuid) != 0;
}

std::optional<LostService> LostServices::on_gone(const fabric::InstanceId& instance, Moment now) {
  const auto gone = instances_.extract(instance);
  if (gone.empty() || gone.mapped().draining || lost_.size() >= most_lost) {
    return std::nullopt;
  }
  const std::string& uuid = gone.mapped().uuid;
  const bool has_others =
      std::ranges::any_of(instances_, [&](const auto& other) { return other.second.uuid == uuid; });
  if (has_others) {
    return std::nullopt;
  }
  lost_.insert_or_assign(uuid, now.steady + kept);
  return LostService{uuid, gone.mapped(), now.wall};
}

std::vector<std::string> LostServices::on_time(Moment now) {
  std::vector<std::string> over;
  std::erase_if(lost_, [&](const auto& one) {
    const bool is = one.second <= now.steady;
    if (is) {
      over.push_back(one.first);
    }
    return is;
  });
  return over;
}

}  // namespace millrace::gateway::core
