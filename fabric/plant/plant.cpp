#include "fabric/plant/plant.hpp"

#include <algorithm>
#include <iterator>

#include "base/messages/catalogue.hpp"
#include "base/text/ascii.hpp"
#include "fabric/channel_scope.hpp"

namespace millrace::fabric::plant {

bool Plant::add(const observer::Entry& entry) {
  if (const auto* news = std::get_if<observer::InstanceNews>(&entry.sample)) {
    return add(*news, entry.at);
  }
  if (const auto* status = std::get_if<InstanceStatus>(&entry.sample)) {
    add(*status);
  } else if (const auto* channel = std::get_if<ChannelStatus>(&entry.sample)) {
    return add(*channel);
  } else if (const auto* machine = std::get_if<MachineStatus>(&entry.sample)) {
    return add(*machine);
  } else if (const auto* event = std::get_if<ProgramEvent>(&entry.sample)) {
    return add(*event);
  } else if (const auto* alarm = std::get_if<observer::AlarmNews>(&entry.sample)) {
    return add(*alarm, entry.at);
  }
  return false;
}

bool Plant::add(const observer::InstanceNews& news, Time at) {
  const InstanceId& id = news.identity.id;
  if (observer::is_absent(news.change)) {
    early_.erase(id);
    return mark_gone(id, at, news.change == observer::Change::silent);
  }
  const bool is_back = gone_.erase(id) > 0;
  const auto [instance, fresh] = instances_.try_emplace(id);
  if (fresh && !is_back) {
    mark_replaced(news.identity.uuid);
  }
  instance->second.identity = news.identity;
  if (const auto early = early_.extract(id)) {
    instance->second.status = early.mapped();
  }
  return fresh;
}

void Plant::add(const InstanceStatus& status) {
  const auto instance = instances_.find(status.instance);
  if (instance != instances_.end()) {
    instance->second.status = status;
  } else {
    early_.insert_or_assign(status.instance, status);
  }
}

/// A channel without its gateway keeps what the gateway published last: the gateway may only be
/// late.
bool Plant::add(const ChannelStatus& status) {
  if (status.gone && is_forgotten(machine_of(status.key.machine))) {
    return false;
  }
  const auto known = channels_.find(status.key);
  if (status.gone && known != channels_.end()) {
    known->second.gone = true;
    return false;
  }
  return channels_.insert_or_assign(status.key, status).second;
}

template <typename Change>
void Plant::for_programs_of(const std::string& machine, const Change& change) {
  for (auto program = programs_.lower_bound({machine, 0});
       program != programs_.end() && program->first.machine == machine;) {
    program = change(program->second) ? programs_.erase(program) : std::next(program);
  }
}

/// Of a machine that another gateway serves, only this gateway is forgotten.
void Plant::forget(const MachineStatus& removed) {
  machines_.erase({removed.machine, removed.gateway});
  presence_.erase({removed.machine, removed.gateway});
  if (!has_gateway(removed.machine)) {
    forget_channels_of(removed.machine);
  }
}

void Plant::forget_channels_of(const std::string& machine) {
  std::erase_if(channels_,
                [&](const auto& channel) { return machine_of(channel.first.machine) == machine; });
  for_programs_of(machine, [](const Program&) { return true; });
}

bool Plant::forget_machine(const std::string& machine) {
  const auto first = machines_.lower_bound({machine, {}});
  const auto end = std::find_if(first, machines_.end(),
                                [&](const auto& each) { return each.first.first != machine; });
  if (first == end || has_gateway(machine)) {
    return false;
  }
  // Their presence shows that the machine is forgotten: is_forgotten().
  std::for_each(first, end, [&](const auto& each) {
    presence_.try_emplace(each.first, Presence{.last = each.second});
  });
  machines_.erase(first, end);
  forget_channels_of(machine);
  return true;
}

bool Plant::is_forgotten(std::string_view machine) const {
  const auto any = presence_.lower_bound({std::string(machine), {}});
  return any != presence_.end() && any->first.first == machine && !knows_machine(machine);
}

bool Plant::add(const MachineStatus& status) {
  if (status.gone && base::messages::machine_removed.is(status.reason)) {
    forget(status);
    return false;
  }
  if (status.gone && is_forgotten(status.machine)) {
    return false;
  }
  const auto same = machines_.find({status.machine, status.gateway});
  const bool was_present = same != machines_.end() && !same->second.gone;
  const Time gone_since = same == machines_.end() ? Time{} : same->second.since;
  const bool had_gateway = has_gateway(status.machine);
  if (!status.gone) {
    gateways_.insert_or_assign(status.gateway, status);
    Presence& presence = presence_[{status.machine, status.gateway}];
    presence.last = status;
    presence.lost_link =
        !status.connected &&
        (presence.lost_link || (loses_link(status) && !is_connected_through_another(status)));
  }
  if (status.connected) {
    // Their gateway is there and has them no longer: they were removed from its configuration.
    std::erase_if(channels_, [&](const auto& channel) {
      return channel.second.gone && machine_of(channel.first.machine) == status.machine;
    });
  }
  const bool fresh = same == machines_.end();
  const bool was_gone = !fresh && same->second.gone;
  MachineStatus& kept =
      machines_.insert_or_assign({status.machine, status.gateway}, status).first->second;
  if (was_gone && status.gone) {
    // It was silent, and now its process is gone, too.
    kept.since = gone_since;
  }
  if (had_gateway && !has_gateway(status.machine)) {
    for_programs_of(status.machine, [](Program& program) {
      program.stale = true;
      return false;
    });
  } else if (!had_gateway && !status.gone && !was_present) {
    // It publishes changes only, so its last events still hold; another one repeats an error that
    // still stands.
    for_programs_of(status.machine, [&](Program& program) {
      const bool is_forgotten = fresh && program.stale;
      program.stale = program.stale && fresh;
      return is_forgotten;
    });
  }
  return fresh;
}

bool Plant::add(const ProgramEvent& event) {
  using enum ProgramEventKind;
  if (event.kind == ended || event.kind == reset) {
    return programs_.erase(event.key) > 0;
  }
  const auto known = programs_.find(event.key);
  const bool is_known = known != programs_.end();
  if (!is_known && programs_.size() >= most_programs) {
    return false;
  }
  // A gateway that has found an error knows less of its run than the one that saw it.
  if (is_known && known->second.state == Program::State::aborted && event.kind == aborted &&
      event.started == Time{}) {
    known->second.stale = false;
    return false;
  }
  Program program{.state = event.kind == aborted   ? Program::State::aborted
                           : event.kind == on_hold ? Program::State::on_hold
                                                   : Program::State::running,
                  .event = event};
  // Fields that an event leaves out keep their values.
  if (is_known && program.event.program.empty() && event.started == known->second.event.started) {
    program.event.program = known->second.event.program;
  }
  return programs_.insert_or_assign(event.key, std::move(program)).second;
}

const Program* Plant::program_of(const ChannelKey& key) const {
  const auto program = programs_.find(key);
  return program == programs_.end() || program->second.stale ? nullptr : &program->second;
}

bool Plant::has_gateway(std::string_view machine) const {
  for (auto link = machines_.lower_bound({std::string(machine), {}});
       link != machines_.end() && link->first.first == machine; ++link) {
    if (!link->second.gone) {
      return true;
    }
  }
  return false;
}

bool Plant::has_gateway() const {
  return std::ranges::any_of(machines_, [](const auto& each) { return !each.second.gone; });
}

bool Plant::knows_machine(std::string_view machine) const {
  const auto any = machines_.lower_bound({std::string(machine), {}});
  return any != machines_.end() && any->first.first == machine;
}

bool Plant::is_connected_through_another(const MachineStatus& status) const {
  return std::ranges::any_of(machines_, [&](const auto& each) {
    return each.second.machine == status.machine && each.second.gateway != status.gateway &&
           each.second.connected;
  });
}

bool Plant::loses_link(const MachineStatus& status) const {
  const auto known = machines_.find({status.machine, status.gateway});
  return known != machines_.end() && known->second.connected && !status.connected && !status.gone;
}

bool Plant::lost_link(const MachineStatus& status) const {
  const auto known = presence_.find({status.machine, status.gateway});
  return known != presence_.end() && known->second.lost_link;
}

/// True if it was there.
bool Plant::mark_gone(const InstanceId& id, Time at, bool is_silent) {
  auto instance = instances_.extract(id);
  if (instance.empty()) {
    if (const auto known = gone_.find(id); known != gone_.end()) {
      known->second.silent = known->second.silent && is_silent;
    }
    return false;
  }
  gone_.insert_or_assign(id, GoneInstance{std::move(instance.mapped()), at, is_silent});
  if (gone_.size() > most_gone) {
    gone_.erase(
        std::ranges::min_element(gone_, {}, [](const auto& each) { return each.second.at; }));
  }
  return true;
}

/// A new instance replaces the one that was lost first.
void Plant::mark_replaced(const std::string& uuid) {
  GoneInstance* first = nullptr;
  for (auto& [id, gone] : gone_) {
    const InstanceIdentity& last = gone.last.identity;
    if (last.uuid == uuid && !last.draining && !gone.replaced &&
        (first == nullptr || gone.at < first->at)) {
      first = &gone;
    }
  }
  if (first != nullptr) {
    first->replaced = true;
  }
}

void Plant::forget_gone(Time time) {
  std::erase_if(gone_,
                [&](const auto& each) { return !each.second.silent && each.second.at < time; });
  std::erase_if(lost_processes_, [&](const auto& each) { return each.second.at < time; });
}

const MachineStatus* Plant::last_sample(const MachineStatus& status) const {
  const auto known = presence_.find({status.machine, status.gateway});
  return known == presence_.end() ? nullptr : &known->second.last;
}

std::optional<LostMachine> Plant::lost(std::string_view machine) const {
  const MachineStatus* newest = nullptr;
  for (auto link = machines_.lower_bound({std::string(machine), {}});
       link != machines_.end() && link->first.first == machine; ++link) {
    if (!link->second.gone) {
      return std::nullopt;
    }
    if (newest == nullptr || link->second.since >= newest->since) {
      newest = &link->second;
    }
  }
  if (newest == nullptr) {
    return std::nullopt;
  }
  const MachineStatus* const last = last_sample(*newest);
  return LostMachine{last == nullptr ? *newest : *last, newest->since, newest->reason};
}

std::vector<LostMachine> Plant::lost() const {
  std::vector<LostMachine> all;
  for (const auto& [key, status] : machines_) {
    if (all.empty() || all.back().last.machine != key.first) {
      if (auto machine = lost(key.first)) {
        all.push_back(std::move(*machine));
      }
    }
  }
  return all;
}

bool says_that_it_runs(const AlarmKey& key) {
  return key.kind == "recording" || key.kind == "page";
}

bool Plant::add(const observer::AlarmNews& news, Time at) {
  if (!news.over) {
    return add(news.alarm);
  }
  const AlarmKey& key = news.alarm.key;
  if (news.lost && says_that_it_runs(key) && alarms_.contains(key) &&
      lost_processes_.size() < most_alarms) {
    lost_processes_.insert_or_assign(key.responder, LostProcess{alarms_.at(key), at});
  }
  alarms_.erase(key);
  return false;
}

bool Plant::add(const Alarm& alarm) {
  if (says_that_it_runs(alarm.key)) {
    // It responds again, or another one does its work.
    std::erase_if(lost_processes_, [&](const auto& lost) {
      const Alarm& last = lost.second.last;
      return lost.first == alarm.key.responder ||
             (last.program == alarm.program && last.host == alarm.host);
    });
  }
  if (alarms_.size() >= most_alarms && !alarms_.contains(alarm.key)) {
    too_many_alarms_ = true;
    return false;
  }
  return alarms_.insert_or_assign(alarm.key, alarm).second;
}

std::size_t Plant::instances_for(const std::string& uuid, const ChannelKey& key) const {
  const std::string canonical = canonical_uuid(uuid);
  const auto takes = [&](const ChannelScope& scope) {
    return (scope.machine.empty() || scope.machine == key.machine) &&
           (scope.channel == 0 || scope.channel == key.channel);
  };
  return static_cast<std::size_t>(std::ranges::count_if(instances_, [&](const auto& each) {
    const InstanceIdentity& identity = each.second.identity;
    return identity.uuid == canonical && !identity.draining &&
           (identity.channels.empty() || std::ranges::any_of(identity.channels, takes));
  }));
}

const Alarm* Plant::journal_alarm(std::string_view machine) const {
  for (const auto& [key, status] : machines_) {
    const auto alarm = alarms_.find({status.gateway, "journal", {}});
    if (status.machine == machine && alarm != alarms_.end()) {
      return &alarm->second;
    }
  }
  return nullptr;
}

std::vector<const KnownInstance*> Plant::instances_of(const std::string& what) const {
  const std::string canonical = canonical_uuid(what);
  const std::string small = base::text::small_letters(what);
  std::vector<const KnownInstance*> found;
  for (const auto& [id, instance] : instances_) {
    if (what.empty() || instance.identity.uuid == canonical || id.to_string() == canonical ||
        base::text::small_letters(instance.identity.name) == small) {
      found.push_back(&instance);
    }
  }
  return found;
}

}  // namespace millrace::fabric::plant
