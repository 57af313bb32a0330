#include "fabric/registry/instance_registry.hpp"

#include <algorithm>
#include <utility>

namespace millrace::fabric::registry {

InstanceRegistry::Seen InstanceRegistry::reader_seen(EndpointHandle handle, Reader reader,
                                                     SteadyTime now) {
  const auto known = readers_.find(handle);
  const bool again = known != readers_.end() && known->second.identity.id == reader.identity.id &&
                     known->second.identity.uuid == reader.identity.uuid &&
                     known->second.participant == reader.participant;
  const bool proved = again && known->second.proved;
  if (!again) {
    forget_reader(handle);
    if (readers_.size() >= most_endpoints && !make_room(&Process::readers, reader.participant)) {
      return Seen::full;
    }
    // An instance that changes its user_data keeps its place.
    readers_of_[reader.identity.id].push_back(handle);
  }
  Process& process = processes_[reader.participant];
  process.readers.insert(handle);
  if (const auto name = names_.find(reader.participant); name != names_.end()) {
    reader.identity.certificate = name->second;
  } else if (authentication_required_ && process.readers.size() == 1) {
    process.reported_at = now + authentication_timeout;
    check_at(*process.reported_at);
  }
  if (reader.identity.lease > process.lease) {
    // From now on it must send heartbeats.
    if (process.lease == SteadyTime::duration(0)) {
      process.heard_at = now;
    }
    process.lease = reader.identity.lease;
    process.busy_lease =
        reader.identity.busy_lease == std::chrono::milliseconds(0)
            ? process.lease
            : std::min<SteadyTime::duration>(process.lease, reader.identity.busy_lease);
    check_at(silent_at(process));
  }
  const InstanceId id = reader.identity.id;
  const EndpointHandle participant = reader.participant;
  readers_.insert_or_assign(handle, SeenReader{std::move(reader), proved});
  prove(id);
  return !has_home(id) || is_home(participant, id) ? Seen::taken : Seen::second;
}

InstanceRegistry::Seen InstanceRegistry::writer_seen(EndpointHandle handle, Writer writer) {
  // A match proves what a writer announced first.
  if (writers_.contains(handle)) {
    return Seen::taken;
  }
  if (writers_.size() >= most_endpoints && !make_room(&Process::writers, writer.participant)) {
    return Seen::full;
  }
  processes_[writer.participant].writers.insert(handle);
  const InstanceId id = writer.instance;
  writers_of_[id].insert(handle);
  writers_.emplace(handle, std::move(writer));
  prove(id);
  return Seen::taken;
}

void InstanceRegistry::heartbeat_writer_seen(EndpointHandle handle, EndpointHandle participant) {
  if (heartbeat_writers_.contains(handle) ||
      (heartbeat_writers_.size() >= most_endpoints &&
       !make_room(&Process::heartbeat_writers, participant))) {
    return;
  }
  heartbeat_writers_.emplace(handle, participant);
  processes_[participant].heartbeat_writers.insert(handle);
}

bool InstanceRegistry::make_room(std::set<EndpointHandle> Process::*of,
                                 EndpointHandle participant) {
  const auto most = std::ranges::max_element(
      processes_, {}, [of](const auto& process) { return (process.second.*of).size(); });
  if (most == processes_.end() || most->first == participant) {
    return false;
  }
  const auto& endpoints = most->second.*of;
  const auto unmatched = std::ranges::find_if(
      endpoints, [this](EndpointHandle handle) { return !matched_.contains(handle); });
  const EndpointHandle displaced = unmatched == endpoints.end() ? *endpoints.begin() : *unmatched;
  forget_reader(displaced);
  forget_writer(displaced);
  forget_heartbeat_writer(displaced);
  return true;
}

void InstanceRegistry::endpoint_gone(EndpointHandle handle) {
  matched_.erase(handle);
  forget_reader(handle);
  if (const auto writer = writers_.find(handle); writer != writers_.end()) {
    departed_.put(handle, writer->second);
  }
  forget_writer(handle);
  forget_heartbeat_writer(handle);
}

void InstanceRegistry::forget_reader(EndpointHandle handle) {
  const auto reader = readers_.extract(handle);
  if (reader.empty()) {
    return;
  }
  const InstanceId& id = reader.mapped().identity.id;
  touched_.insert(id);
  const auto home = readers_of_.find(id);
  std::erase(home->second, handle);
  if (home->second.empty()) {
    readers_of_.erase(home);
  }
  processes_[reader.mapped().participant].readers.erase(handle);
  forget_process(reader.mapped().participant);
}

void InstanceRegistry::forget_writer(EndpointHandle handle) {
  const auto writer = writers_.extract(handle);
  if (writer.empty()) {
    return;
  }
  const InstanceId& id = writer.mapped().instance;
  touched_.insert(id);
  const auto home = writers_of_.find(id);
  home->second.erase(handle);
  if (home->second.empty()) {
    writers_of_.erase(home);
  }
  processes_[writer.mapped().participant].writers.erase(handle);
  forget_process(writer.mapped().participant);
}

void InstanceRegistry::forget_heartbeat_writer(EndpointHandle handle) {
  if (const auto writer = heartbeat_writers_.extract(handle); !writer.empty()) {
    processes_[writer.mapped()].heartbeat_writers.erase(handle);
    forget_process(writer.mapped());
  }
}

/// If there is nothing of it any more.
void InstanceRegistry::forget_process(EndpointHandle participant) {
  const auto process = processes_.find(participant);
  if (process->second.readers.empty() && process->second.writers.empty() &&
      process->second.heartbeat_writers.empty()) {
    processes_.erase(process);
  }
}

void InstanceRegistry::matched(EndpointHandle handle, bool is) {
  if (is) {
    matched_.insert(handle);
  } else {
    matched_.erase(handle);
  }
  touch(handle);
}

void InstanceRegistry::touch(EndpointHandle handle) {
  if (const auto reader = readers_.find(handle); reader != readers_.end()) {
    touched_.insert(reader->second.identity.id);
  }
  if (const auto writer = writers_.find(handle); writer != writers_.end()) {
    prove(writer->second.instance);
  }
}

void InstanceRegistry::prove(const InstanceId& id) {
  touched_.insert(id);
  if (const auto readers = readers_of_.find(id); readers != readers_of_.end()) {
    for (const EndpointHandle handle : readers->second) {
      SeenReader& reader = readers_.at(handle);
      reader.proved = reader.proved || can_answer(reader);
    }
  }
}

void InstanceRegistry::touch_all_of(const Process& process) {
  for (const EndpointHandle reader : process.readers) {
    touch(reader);
  }
}

void InstanceRegistry::authenticated(EndpointHandle participant, std::optional<std::string> name) {
  gone_names_.erase(participant);
  if (name) {
    names_.insert_or_assign(participant, *name);
  } else {
    names_.erase(participant);
  }
  const auto process = processes_.find(participant);
  if (process == processes_.end()) {
    return;
  }
  process->second.reported_at.reset();
  for (const EndpointHandle reader : process->second.readers) {
    readers_.at(reader).identity.certificate = name.value_or("");
  }
  touch_all_of(process->second);
}

void InstanceRegistry::authenticated_gone(EndpointHandle participant) {
  if (names_.erase(participant) == 0) {
    return;
  }
  gone_names_.put(participant);
  if (const auto process = processes_.find(participant); process != processes_.end()) {
    touch_all_of(process->second);
  }
}

std::vector<InstanceId> InstanceRegistry::instances_of(EndpointHandle participant) const {
  std::vector<InstanceId> all;
  if (const auto process = processes_.find(participant); process != processes_.end()) {
    for (const EndpointHandle reader : process->second.readers) {
      all.push_back(readers_.at(reader).identity.id);
    }
  }
  return all;
}

/// Reported once for each process.
void InstanceRegistry::report_unauthenticated(Process& process, SteadyTime now) {
  if (!process.reported_at) {
    return;
  }
  if (*process.reported_at > now) {
    check_at(*process.reported_at);
    return;
  }
  process.reported_at.reset();
  for (const EndpointHandle reader : process.readers) {
    const InstanceIdentity& identity = readers_.at(reader).identity;
    unauthenticated_.emplace_back(identity.id, identity.uuid);
  }
}

bool InstanceRegistry::heartbeat(EndpointHandle writer, SteadyTime now, std::optional<bool> busy) {
  const auto known = heartbeat_writers_.find(writer);
  if (known == heartbeat_writers_.end()) {
    return false;
  }
  Process& process = processes_[known->second];
  process.heard_at = std::max(process.heard_at, now);
  process.requested_at.reset();
  const bool was_busy = std::exchange(process.busy, busy.value_or(process.busy));
  const bool was_silent = std::exchange(process.silent, false);
  if (was_silent || (process.busy && !was_busy)) {
    check_at(silent_at(process));
  }
  if (was_silent) {
    touch_all_of(process);
  }
  return !process.readers.empty();
}

void InstanceRegistry::requested(const InstanceId& instance, SteadyTime now) {
  const SeenReader* const home = home_of(instance);
  if (home == nullptr) {
    return;
  }
  Process& process = processes_.at(home->participant);
  if (!process.requested_at) {
    process.requested_at = now;
    if (process.lease != SteadyTime::duration(0)) {
      check_at(silent_at(process));
    }
  }
}

void InstanceRegistry::stood_still(std::chrono::nanoseconds late) {
  const auto by = std::chrono::duration_cast<SteadyTime::duration>(late);
  for (auto& [participant, process] : processes_) {
    process.heard_at += by;
    if (process.requested_at) {
      *process.requested_at += by;
    }
  }
}

void InstanceRegistry::start_over(SteadyTime now) {
  for (auto& [participant, process] : processes_) {
    process.heard_at = std::max(process.heard_at, now);
    if (process.requested_at) {
      process.requested_at = now;
    }
  }
}

/// A fifth of the lease is left for the reaction of readers.
SteadyTime InstanceRegistry::silent_at(const Process& process) {
  const auto [lease, busy_lease] = std::pair(process.lease, process.busy_lease);
  const SteadyTime end = process.heard_at + (process.busy ? busy_lease : lease) * 4 / 5;
  if (!process.requested_at) {
    return end;
  }
  // The request may be lost, or repeated late: then the next heartbeat comes when that of an idle
  // process does.
  return std::min(end, std::max(*process.requested_at + busy_lease * 4 / 5,
                                process.heard_at + lease / 4 + busy_lease / 10));
}

void InstanceRegistry::on_time(SteadyTime now) {
  if (!check_at_ || now < *check_at_) {
    return;
  }
  check_at_.reset();
  for (auto& [participant, process] : processes_) {
    report_unauthenticated(process, now);
    if (process.lease == SteadyTime::duration(0) || process.silent) {
      continue;
    }
    if (const SteadyTime end = silent_at(process); end <= now) {
      process.silent = true;
      touch_all_of(process);
    } else {
      check_at(end);
    }
  }
}

const InstanceRegistry::Writer* InstanceRegistry::writer_of(EndpointHandle handle) const {
  if (const auto found = writers_.find(handle); found != writers_.end()) {
    return &found->second;
  }
  return departed_.find(handle);
}

bool InstanceRegistry::speaks_for(EndpointHandle handle, const InstanceId& instance) const {
  const Writer* const writer = writer_of(handle);
  if (writer == nullptr || writer->instance != instance ||
      !was_authenticated(writer->participant)) {
    return false;
  }
  const SeenReader* const home = home_of(instance);
  return home == nullptr || home->participant == writer->participant;
}

const InstanceRegistry::SeenReader* InstanceRegistry::home_of(const InstanceId& id) const {
  const auto readers = readers_of_.find(id);
  if (readers == readers_of_.end()) {
    return nullptr;
  }
  const SeenReader* home = nullptr;
  for (const EndpointHandle handle : readers->second) {
    const SeenReader& reader = readers_.at(handle);
    if (reader.proved && is_authenticated(reader.participant) &&
        (home == nullptr || (reader.made_id && !home->made_id))) {
      home = &reader;
    }
  }
  return home;
}

std::vector<std::pair<InstanceId, std::optional<std::string>>> InstanceRegistry::touched_homes()
    const {
  std::vector<std::pair<InstanceId, std::optional<std::string>>> homes;
  for (const InstanceId& id : touched_) {
    const SeenReader* const home = home_of(id);
    homes.emplace_back(id, home != nullptr ? std::optional(home->identity.uuid) : std::nullopt);
  }
  return homes;
}

bool InstanceRegistry::heartbeats_for(EndpointHandle handle, const InstanceId& instance) const {
  const auto writer = heartbeat_writers_.find(handle);
  return writer != heartbeat_writers_.end() && is_home(writer->second, instance);
}

bool InstanceRegistry::can_answer(const Reader& reader) const {
  const auto writers = writers_of_.find(reader.identity.id);
  return writers != writers_of_.end() &&
         std::ranges::any_of(writers->second, [&](EndpointHandle handle) {
           const Writer& writer = writers_.at(handle);
           return (writers_match_ || matched_.contains(handle)) &&
                  writer.participant == reader.participant && writer.uuid == reader.identity.uuid;
         });
}

const InstanceIdentity* InstanceRegistry::ready_now(const InstanceId& id) const {
  const SeenReader* const home = home_of(id);
  if (home == nullptr) {
    return nullptr;
  }
  for (const EndpointHandle handle : readers_of_.at(id)) {
    const SeenReader& reader = readers_.at(handle);
    if (reader.participant == home->participant && reader.proved &&
        (readers_match_ || matched_.contains(handle)) &&
        !processes_.at(reader.participant).silent && can_answer(reader)) {
      return &reader.identity;
    }
  }
  return nullptr;
}

bool InstanceRegistry::is_silent(const InstanceId& id) const {
  const SeenReader* const home = home_of(id);
  return home != nullptr && processes_.at(home->participant).silent;
}

InstanceRegistry::Changes InstanceRegistry::changes() {
  Changes changes;
  for (const InstanceId& id : std::exchange(touched_, {})) {
    const InstanceIdentity* const ready = ready_now(id);
    auto known = announced_.find(id);
    // An id that another process of another UUID has from now on is another instance.
    if (known != announced_.end() && (ready == nullptr || ready->uuid != known->second.uuid)) {
      changes.gone.push_back(id);
      announced_.erase(known);
      known = announced_.end();
      if (is_silent(id)) {
        changes.silent.push_back(id);
        silent_.insert(id);
      }
    }
    if (ready == nullptr) {
      if (silent_.contains(id) && !is_silent(id)) {
        changes.left.push_back(id);
        silent_.erase(id);
      }
      continue;
    }
    silent_.erase(id);
    if (known == announced_.end()) {
      changes.ready.push_back(*ready);
      announced_.emplace(id, *ready);
    } else if (known->second != *ready) {
      changes.changed.push_back(*ready);
      known->second = *ready;
    }
  }
  return changes;
}

}  // namespace millrace::fabric::registry
