#include "fabric/one_sided_loss.hpp"

#include <utility>

namespace millrace::fabric {

void OneSidedLoss::on_authenticated(Handle participant, Who who) {
  lost_.erase(who.guid_prefix);
  authenticated_.insert_or_assign(participant, std::move(who));
}

void OneSidedLoss::on_lost(Handle participant) {
  if (auto node = authenticated_.extract(participant)) {
    lost_.put(node.mapped().guid_prefix, std::move(node.mapped().name));
  }
}

std::optional<std::string> OneSidedLoss::find(Clock::time_point now,
                                              const std::set<std::string>& announced) {
  if (std::exchange(last_, now).value_or(now) + standstill < now) {
    announced_.clear();
  }
  std::optional<std::string> found;
  std::map<std::string, Clock::time_point> still;
  for (const std::string& participant : announced) {
    const std::string* const name = lost_.find(participant);
    if (name == nullptr) {
      continue;
    }
    const auto known = announced_.find(participant);
    const auto since = known == announced_.end() ? now : known->second;
    still.emplace(participant, since);
    if (now - since > patience_) {
      found = *name;
    }
  }
  announced_ = std::move(still);
  return found;
}

}  // namespace millrace::fabric
