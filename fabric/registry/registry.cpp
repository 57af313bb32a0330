#include "fabric/registry/registry.hpp"

#include <algorithm>

namespace millrace::fabric::registry {

void Registry::reader_seen(EndpointHandle handle, Reader reader) {
  forget_reader(handle);
  homes_[reader.identity.id].emplace(handle, reader.participant);
  readers_.emplace(handle, std::move(reader));
}

void Registry::writer_seen(EndpointHandle handle, Writer writer) {
  writers_.insert_or_assign(handle, writer);
}

void Registry::endpoint_gone(EndpointHandle handle) {
  forget_reader(handle);
  if (const auto writer = writers_.extract(handle); !writer.empty()) {
    departed_.emplace_back(handle, writer.mapped());
    if (departed_.size() > most_departed) {
      departed_.pop_front();
    }
  }
}

void Registry::forget_reader(EndpointHandle handle) {
  const auto reader = readers_.extract(handle);
  if (reader.empty()) {
    return;
  }
  const auto home = homes_.find(reader.mapped().identity.id);
  home->second.erase(handle);
  if (home->second.empty()) {
    homes_.erase(home);
  }
}

const Registry::Writer* Registry::writer_of(EndpointHandle handle) const {
  if (const auto found = writers_.find(handle); found != writers_.end()) {
    return &found->second;
  }
  const auto left = std::ranges::find(departed_, handle, [](const auto& one) { return one.first; });
  return left == departed_.end() ? nullptr : &left->second;
}

bool Registry::speaks_for(EndpointHandle handle, const InstanceId& instance) const {
  const Writer* const writer = writer_of(handle);
  if (writer == nullptr || writer->instance != instance) {
    return false;
  }
  const auto home = homes_.find(instance);
  return home == homes_.end() || std::ranges::any_of(home->second, [&](const auto& one) {
           return one.second == writer->participant;
         });
}

void Registry::set_matched(std::set<EndpointHandle> handles) {
  matched_ = std::move(handles);
}

std::map<InstanceId, InstanceIdentity> Registry::ready_now() const {
  std::set<std::pair<InstanceId, EndpointHandle>> answering;
  for (const auto& [handle, writer] : writers_) {
    if (is_matched(handle)) {
      answering.emplace(writer.instance, writer.participant);
    }
  }
  std::map<InstanceId, InstanceIdentity> ready;
  for (const auto& [handle, reader] : readers_) {
    if (is_matched(handle) && answering.contains({reader.identity.id, reader.participant})) {
      ready.emplace(reader.identity.id, reader.identity);
    }
  }
  return ready;
}

Registry::Changes Registry::changes() {
  Changes changes;
  auto ready = ready_now();
  for (const auto& [id, identity] : announced_) {
    if (!ready.contains(id)) {
      changes.gone.push_back(id);
    }
  }
  for (const auto& [id, identity] : ready) {
    const auto known = announced_.find(id);
    if (known == announced_.end()) {
      changes.ready.push_back(identity);
    } else if (known->second != identity) {
      changes.changed.push_back(identity);
    }
  }
  announced_ = std::move(ready);
  return changes;
}

}  // namespace millrace::fabric::registry
