#include "fabric/badge_book.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "fabric/channel_scope.hpp"

namespace millrace::fabric {

void BadgeBook::put_on(Handle writer, Handle participant, Badge badge) {
  badges_.insert_or_assign(writer, participant);
  worn_.insert_or_assign(participant, Worn{std::make_shared<const Badge>(std::move(badge))});
}

std::optional<BadgeBook::Handle> BadgeBook::take_off(Handle writer) {
  const auto known = badges_.extract(writer);
  if (known.empty()) {
    return std::nullopt;
  }
  const Handle participant = known.mapped();
  worn_.at(participant).there = false;
  left_.push_back(participant);
  if (left_.size() > most_departed) {
    const auto oldest = worn_.find(left_.front());
    if (oldest != worn_.end() && !oldest->second.there) {
      worn_.erase(oldest);
    }
    left_.pop_front();
  }
  return participant;
}

void BadgeBook::matched(Handle writer, Handle participant, std::string name) {
  Seen& seen = writers_[writer];
  seen.participant = participant;
  seen.name = std::move(name);
  ++seen.matched;
}

void BadgeBook::unmatched(Handle writer) {
  const auto known = writers_.find(writer);
  if (known == writers_.end() || known->second.matched == 0 || --known->second.matched > 0) {
    return;
  }
  left_writers_.push_back(writer);
  if (left_writers_.size() > most_departed) {
    const auto oldest = writers_.find(left_writers_.front());
    if (oldest != writers_.end() && oldest->second.matched == 0) {
      writers_.erase(oldest);
    }
    left_writers_.pop_front();
  }
}

std::vector<BadgeBook::Handle> BadgeBook::revoke(const std::set<std::string>& names) {
  std::vector<Handle> news;
  for (const auto& [participant, one] : worn_) {
    if (one.there && names.contains(one.badge->name) && !is_revoked(one.badge->name)) {
      news.push_back(participant);
    }
  }
  revoked_.insert(names.begin(), names.end());
  return news;
}

std::vector<std::string> BadgeBook::left_out_of(const std::set<std::string>& names) const {
  std::vector<std::string> all;
  std::ranges::set_difference(revoked_, names, std::back_inserter(all));
  return all;
}

Proof BadgeBook::proof_of(Handle participant) const {
  const auto known = worn_.find(participant);
  if (known == worn_.end()) {
    return {};
  }
  return {known->second.badge, is_revoked(known->second.badge->name)};
}

Proof BadgeBook::proof_of_writer(Handle writer) const {
  const auto known = writers_.find(writer);
  return known == writers_.end() ? Proof{} : proof_of(known->second.participant);
}

std::string BadgeBook::name_of_writer(Handle writer) const {
  const auto known = writers_.find(writer);
  return known == writers_.end() ? std::string() : known->second.name;
}

bool BadgeBook::has_gateway_of(std::string_view machine) const {
  const std::string name(machine_of(machine));
  return std::ranges::any_of(worn_, [&](const auto& one) {
    return one.second.there && one.second.badge->machines.contains(name);
  });
}

bool BadgeBook::is_there(Handle participant) const {
  const auto known = worn_.find(participant);
  return known != worn_.end() && known->second.there;
}

std::vector<BadgeBook::Handle> BadgeBook::participants() const {
  std::vector<Handle> all;
  for (const auto& [participant, one] : worn_) {
    if (one.there) {
      all.push_back(participant);
    }
  }
  return all;
}

}  // namespace millrace::fabric
