#include "tools/bus/fabric_model.hpp"

#include <algorithm>
#include <set>

#include "fabric/channel_scope.hpp"

namespace millrace::tools::bus {

bool FabricModel::add(const recording::Entry& entry) {
  if (const auto* news = std::get_if<recording::InstanceNews>(&entry.sample)) {
    const fabric::InstanceId& id = news->identity.id;
    if (news->change == recording::Change::gone) {
      early_.erase(id);
      const bool was_there = instances_.contains(id);
      mark_gone(id, entry.at);
      return was_there;
    }
    gone_.erase(id);
    const auto [instance, fresh] = instances_.try_emplace(id);
    instance->second.identity = news->identity;
    if (const auto early = early_.extract(id)) {
      instance->second.status = early.mapped();
    }
    return fresh;
  }
  if (const auto* status = std::get_if<fabric::InstanceStatus>(&entry.sample)) {
    const auto instance = instances_.find(status->instance);
    if (instance != instances_.end()) {
      instance->second.status = *status;
    } else {
      early_.insert_or_assign(status->instance, *status);
    }
  } else if (const auto* channel = std::get_if<fabric::ChannelStatus>(&entry.sample)) {
    return channels_.insert_or_assign(channel->key, *channel).second;
  } else if (const auto* machine = std::get_if<fabric::MachineStatus>(&entry.sample)) {
    if (!machine->gone) {
      gateways_.insert_or_assign(machine->gateway, *machine);
      told_.insert_or_assign({machine->machine, machine->gateway}, *machine);
    }
    return machines_.insert_or_assign({machine->machine, machine->gateway}, *machine).second;
  } else if (const auto* said = std::get_if<recording::AlarmNews>(&entry.sample)) {
    if (said->over) {
      take_back(said->alarm.key);
    } else {
      return add(said->alarm);
    }
  }
  return false;
}

void FabricModel::mark_gone(const fabric::InstanceId& id, fabric::Time at) {
  auto instance = instances_.extract(id);
  if (instance.empty()) {
    return;
  }
  gone_.insert_or_assign(id, GoneInstance{std::move(instance.mapped()), at});
  if (gone_.size() > most_gone) {
    gone_.erase(std::ranges::min_element(gone_, {}, [](const auto& one) { return one.second.at; }));
  }
}

void FabricModel::forget_gone(fabric::Time time) {
  std::erase_if(gone_, [&](const auto& one) { return one.second.at < time; });
}

const fabric::MachineStatus* FabricModel::told(const fabric::MachineStatus& status) const {
  const auto told = told_.find({status.machine, status.gateway});
  return told == told_.end() ? nullptr : &told->second;
}

std::vector<LostMachine> FabricModel::lost() const {
  std::map<std::string, LostMachine> found;
  std::set<std::string> heard;
  for (const auto& [key, status] : machines_) {
    if (!status.gone) {
      heard.insert(status.machine);
    } else if (LostMachine& lost = found[status.machine]; status.since >= lost.since) {
      const fabric::MachineStatus* last = told(status);
      lost = {last == nullptr ? status : *last, status.since};
    }
  }
  std::vector<LostMachine> all;
  for (auto& [machine, lost] : found) {
    if (!heard.contains(machine)) {
      all.push_back(std::move(lost));
    }
  }
  return all;
}

bool FabricModel::add(const fabric::Alarm& alarm) {
  if (alarms_.size() >= most_alarms && !alarms_.contains(alarm.key)) {
    too_many_alarms_ = true;
    return false;
  }
  return alarms_.insert_or_assign(alarm.key, alarm).second;
}

std::size_t FabricModel::instances_for(const std::string& uuid,
                                       const fabric::ChannelKey& key) const {
  const std::string canonical = fabric::canonical_uuid(uuid);
  const auto takes = [&](const fabric::ChannelScope& scope) {
    return (scope.machine.empty() || scope.machine == key.machine) &&
           (scope.channel == 0 || scope.channel == key.channel);
  };
  return static_cast<std::size_t>(std::ranges::count_if(instances_, [&](const auto& one) {
    const fabric::InstanceIdentity& identity = one.second.identity;
    return identity.uuid == canonical && !identity.draining &&
           (identity.channels.empty() || std::ranges::any_of(identity.channels, takes));
  }));
}

const fabric::Alarm* FabricModel::journal_alarm(std::string_view machine) const {
  for (const auto& [key, status] : machines_) {
    const auto alarm = alarms_.find({status.gateway, "journal", {}});
    if (status.machine == machine && alarm != alarms_.end()) {
      return &alarm->second;
    }
  }
  return nullptr;
}

Obstacle FabricModel::obstacle_of(const fabric::ChannelStatus& status, fabric::Time now) const {
  using enum fabric::ChannelState;
  switch (status.state) {
    case held:
      return Obstacle::held;
    case unserved:
      return journal_alarm(fabric::machine_of(status.key.machine)) != nullptr ? Obstacle::journal
                                                                              : Obstacle::unserved;
    case waiting:
      if (instances_for(status.uuid, status.key) == 0) {
        return Obstacle::unserved;
      }
      return now - status.since > patience_of_a_call ? Obstacle::long_busy : Obstacle::busy;
    default:
      return Obstacle::none;
  }
}

std::vector<const KnownInstance*> FabricModel::instances_of(const std::string& what) const {
  const std::string canonical = fabric::canonical_uuid(what);
  std::vector<const KnownInstance*> found;
  for (const auto& [id, instance] : instances_) {
    if (what.empty() || instance.identity.uuid == canonical || id.to_string() == canonical ||
        instance.identity.name == what) {
      found.push_back(&instance);
    }
  }
  return found;
}

}  // namespace millrace::tools::bus
