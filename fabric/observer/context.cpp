#include "fabric/observer/context.hpp"

namespace millrace::fabric::observer {

namespace {

template <typename Map, typename Key>
const typename Map::mapped_type* find(const Map& map, const Key& key) {
  const auto place = map.find(key);
  return place == map.end() ? nullptr : &place->second;
}

}  // namespace

void Context::complete(Entry& entry) {
  if (auto* request = std::get_if<Request>(&entry.sample)) {
    entry.uuid = canonical_uuid(request->uuid);
  } else if (auto* event = std::get_if<Event>(&entry.sample)) {
    entry.uuid = canonical_uuid(event->uuid);
  } else if (auto* status = std::get_if<ChannelStatus>(&entry.sample)) {
    entry.uuid = canonical_uuid(status->uuid);
  } else if (auto* news = std::get_if<InstanceNews>(&entry.sample)) {
    if (news->identity.uuid.empty()) {
      if (const std::string* uuid = find(uuid_of_instance_, news->identity.id)) {
        news->identity.uuid = *uuid;
      }
    }
    entry.uuid = news->identity.uuid;
  } else if (auto* load = std::get_if<InstanceStatus>(&entry.sample)) {
    if (const std::string* uuid = find(uuid_of_instance_, load->instance)) {
      entry.uuid = *uuid;
    }
  } else if (auto* reply = std::get_if<Reply>(&entry.sample)) {
    if (const std::string* uuid = find(uuid_of_instance_, reply->instance)) {
      entry.uuid = *uuid;
    }
    for_each_requester(key_of(*reply), [&](const RequestKey& key, const Pending& pending) {
      if (key.instance == reply->instance && pending.call == reply->call) {
        entry.uuid = pending.uuid;
      }
    });
  } else if (auto* withdrawal = std::get_if<Withdrawal>(&entry.sample)) {
    const RequestKey key{withdrawal->key, withdrawal->call.epoch, withdrawal->instance,
                         withdrawal->requester};
    const Pending* pending = find(pending_, key);
    withdrawal->call = pending == nullptr ? CallId{} : pending->call;
    entry.uuid = pending == nullptr ? std::string() : pending->uuid;
  }
  remember(entry);
}

template <typename Use>
void Context::for_each_requester(const RequestKey& from, const Use& use) const {
  for (auto pending = pending_.lower_bound({from.key, from.epoch, {}});
       pending != pending_.end() && pending->first.key == from.key &&
       pending->first.epoch == from.epoch;
       ++pending) {
    use(pending->first, pending->second);
  }
}

bool Context::has_asked(const RequestKey& key) const {
  bool others = false;
  for_each_requester(key, [&](const RequestKey& requester, const Pending&) {
    others = others || requester.instance == key.instance;
  });
  return pending_.contains(key) || !others;
}

bool Context::was_given(const Reply& reply) const {
  bool given = false;
  bool to_others = false;
  for_each_requester(key_of(reply), [&](const RequestKey& key, const Pending& pending) {
    const bool same = pending.call == reply.call;
    given = given || (same && key.instance == reply.instance);
    to_others = to_others || (same && key.instance != reply.instance);
  });
  return given || !to_others;
}

const Command* Context::find_command(const InstanceId& id) const {
  return commands_.find(id);
}

void Context::remember(const Entry& entry) {
  if (const auto* command = std::get_if<Command>(&entry.sample)) {
    if (!commands_.contains(command->id)) {
      commands_.put(command->id, *command);
    }
  } else if (const auto* request = std::get_if<Request>(&entry.sample)) {
    pending_.insert_or_assign(key_of(*request), Pending{request->call, entry.uuid});
    if (const auto old = recent_.put(key_of(*request))) {
      pending_.erase(old->key);
    }
  } else if (const auto* news = std::get_if<InstanceNews>(&entry.sample)) {
    // An instance that is gone may still be heard of: its last replies come on another way.
    if (news->change == Change::ready) {
      uuid_of_instance_.insert_or_assign(news->identity.id, news->identity.uuid);
    } else if (news->change == Change::gone && uuid_of_instance_.contains(news->identity.id)) {
      if (const auto old = gone_.put(news->identity.id)) {
        uuid_of_instance_.erase(old->key);
      }
    }
  }
}

}  // namespace millrace::fabric::observer
