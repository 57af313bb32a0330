#include "tools/bus/live.hpp"

namespace millrace::tools::bus {

bool Live::add(const recording::Entry& entry) {
  if (const auto* news = std::get_if<recording::InstanceNews>(&entry.sample)) {
    const fabric::InstanceId& id = news->identity.id;
    if (news->change == recording::Change::gone) {
      early_.erase(id);
      return instances_.erase(id) != 0;
    }
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
    if (!machine->host.empty()) {
      gateways_.insert_or_assign(machine->gateway, *machine);
    }
    return machines_.insert_or_assign({machine->machine, machine->gateway}, *machine).second;
  } else if (const auto* said = std::get_if<recording::NoticeNews>(&entry.sample)) {
    if (said->over) {
      take_back(said->notice.key);
    } else {
      return add(said->notice);
    }
  }
  return false;
}

bool Live::add(const fabric::Notice& notice) {
  if (notices_.size() >= most_notices && !notices_.contains(notice.key)) {
    too_many_notices_ = true;
    return false;
  }
  return notices_.insert_or_assign(notice.key, notice).second;
}

std::vector<const LiveInstance*> Live::instances_of(const std::string& what) const {
  const std::string canonical = fabric::canonical_uuid(what);
  std::vector<const LiveInstance*> found;
  for (const auto& [id, instance] : instances_) {
    if (what.empty() || instance.identity.uuid == canonical || id.to_string() == canonical ||
        instance.identity.name == what) {
      found.push_back(&instance);
    }
  }
  return found;
}

}  // namespace millrace::tools::bus
