#include "gateway/core/service_faults.hpp"

#include <algorithm>

namespace millrace::gateway::core {

bool LostServices::on_ready(const fabric::InstanceIdentity& identity) {
  if (instances_.size() < most_instances || instances_.contains(identity.id)) {
    instances_.insert_or_assign(identity.id, identity);
  }
  return lost_.erase(identity.uuid) != 0;
}

std::optional<fabric::InstanceIdentity> LostServices::on_gone(const fabric::InstanceId& instance,
                                                              SteadyTime now) {
  auto gone = instances_.extract(instance);
  if (gone.empty() || gone.mapped().draining || lost_.size() >= most_lost) {
    return std::nullopt;
  }
  const std::string& uuid = gone.mapped().uuid;
  const bool has_others =
      std::ranges::any_of(instances_, [&](const auto& other) { return other.second.uuid == uuid; });
  if (has_others) {
    return std::nullopt;
  }
  lost_.insert_or_assign(uuid, now + kept);
  return std::move(gone.mapped());
}

std::vector<std::string> LostServices::on_time(SteadyTime now) {
  std::vector<std::string> over;
  std::erase_if(lost_, [&](const auto& service) {
    const bool is = service.second <= now;
    if (is) {
      over.push_back(service.first);
    }
    return is;
  });
  return over;
}

std::optional<fabric::AlarmLevel> ErrorSeries::on_error(const std::string& uuid, SteadyTime now) {
  if (series_.size() >= most && !series_.contains(uuid)) {
    return std::nullopt;
  }
  Series& series = series_[uuid];
  ++series.errors;
  series.last = now;
  return series.errors == warned_at    ? std::optional(fabric::AlarmLevel::warning)
         : series.errors == problem_at ? std::optional(fabric::AlarmLevel::problem)
                                       : std::nullopt;
}

bool ErrorSeries::on_success(const std::string& uuid) {
  const auto series = series_.extract(uuid);
  return !series.empty() && series.mapped().errors >= warned_at;
}

std::vector<std::string> ErrorSeries::on_time(SteadyTime now) {
  std::vector<std::string> over;
  std::erase_if(series_, [&](const auto& each) {
    const bool is_old = now - each.second.last >= kept;
    if (is_old && each.second.errors >= warned_at) {
      over.push_back(each.first);
    }
    return is_old;
  });
  return over;
}

std::size_t ErrorSeries::length(const std::string& uuid) const {
  const auto series = series_.find(uuid);
  return series == series_.end() ? 0 : series->second.errors;
}

}  // namespace millrace::gateway::core
