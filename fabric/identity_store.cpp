#include "fabric/identity_store.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "fabric/channel_scope.hpp"

namespace millrace::fabric {

void IdentityStore::add(Handle writer, Handle participant, ParticipantIdentity identity) {
  writers_of_identities_.insert_or_assign(writer, participant);
  entries_.insert_or_assign(
      participant, Entry{std::make_shared<const ParticipantIdentity>(std::move(identity))});
}

std::optional<IdentityStore::Handle> IdentityStore::remove(Handle writer) {
  const auto known = writers_of_identities_.extract(writer);
  if (known.empty()) {
    return std::nullopt;
  }
  const Handle participant = known.mapped();
  entries_.at(participant).there = false;
  if (const auto oldest = left_.put(participant)) {
    const auto entry = entries_.find(oldest->key);
    if (entry != entries_.end() && !entry->second.there) {
      entries_.erase(entry);
    }
  }
  return participant;
}

void IdentityStore::matched(Handle writer, Handle participant, std::string name) {
  Seen& seen = writers_[writer];
  seen.participant = participant;
  seen.name = std::move(name);
  ++seen.matched;
}

void IdentityStore::unmatched(Handle writer) {
  const auto known = writers_.find(writer);
  if (known == writers_.end() || known->second.matched == 0 || --known->second.matched > 0) {
    return;
  }
  if (const auto oldest = left_writers_.put(writer)) {
    const auto seen = writers_.find(oldest->key);
    if (seen != writers_.end() && seen->second.matched == 0) {
      writers_.erase(seen);
    }
  }
}

std::vector<IdentityStore::Handle> IdentityStore::revoke(const std::set<std::string>& names) {
  std::vector<Handle> news;
  for (const auto& [participant, entry] : entries_) {
    if (entry.there && names.contains(entry.identity->name) && !is_revoked(entry.identity->name)) {
      news.push_back(participant);
    }
  }
  revoked_.insert(names.begin(), names.end());
  return news;
}

std::vector<std::string> IdentityStore::left_out_of(const std::set<std::string>& names) const {
  std::vector<std::string> all;
  std::ranges::set_difference(revoked_, names, std::back_inserter(all));
  return all;
}

IdentityStatus IdentityStore::status_of(Handle participant) const {
  const auto known = entries_.find(participant);
  if (known == entries_.end()) {
    return {};
  }
  return {known->second.identity, is_revoked(known->second.identity->name)};
}

IdentityStatus IdentityStore::status_of_writer(Handle writer) const {
  const auto known = writers_.find(writer);
  return known == writers_.end() ? IdentityStatus{} : status_of(known->second.participant);
}

std::string IdentityStore::name_of_writer(Handle writer) const {
  const auto known = writers_.find(writer);
  return known == writers_.end() ? std::string() : known->second.name;
}

bool IdentityStore::has_gateway_of(std::string_view machine) const {
  const std::string name(machine_of(machine));
  return std::ranges::any_of(entries_, [&](const auto& entry) {
    return entry.second.there && entry.second.identity->machines.contains(name);
  });
}

bool IdentityStore::is_there(Handle participant) const {
  const auto known = entries_.find(participant);
  return known != entries_.end() && known->second.there;
}

std::vector<IdentityStore::Handle> IdentityStore::participants() const {
  std::vector<Handle> all;
  for (const auto& [participant, entry] : entries_) {
    if (entry.there) {
      all.push_back(participant);
    }
  }
  return all;
}

}  // namespace millrace::fabric
