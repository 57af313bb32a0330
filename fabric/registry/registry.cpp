#include "fabric/registry/registry.hpp"

namespace millrace::fabric::registry {

void Registry::reader_seen(EndpointHandle handle, Reader reader) {
  readers_.insert_or_assign(handle, std::move(reader));
}

void Registry::writer_seen(EndpointHandle handle, Writer writer) {
  writers_.insert_or_assign(handle, writer);
}

void Registry::endpoint_gone(EndpointHandle handle) {
  readers_.erase(handle);
  writers_.erase(handle);
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
