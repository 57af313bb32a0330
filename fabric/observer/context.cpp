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
    const Pending* pending = find(pending_, key_of(*reply));
    const std::string* uuid = find(uuid_of_instance_, reply->instance);
    if (pending != nullptr && pending->call == reply->call) {
      entry.uuid = pending->uuid;
    } else if (uuid != nullptr) {
      entry.uuid = *uuid;
    }
  } else if (auto* withdrawal = std::get_if<Withdrawal>(&entry.sample)) {
    const RequestKey key{withdrawal->key, withdrawal->call.epoch, withdrawal->instance};
    const Pending* pending = find(pending_, key);
    withdrawal->call = pending == nullptr ? CallId{} : pending->call;
    entry.uuid = pending == nullptr ? std::string() : pending->uuid;
  }
  remember(entry);
}

void Context::remember(const Entry& entry) {
  if (const auto* request = std::get_if<Request>(&entry.sample)) {
    pending_.insert_or_assign(key_of(*request), Pending{request->call, entry.uuid});
    if (const auto old = recent_.use(key_of(*request))) {
      pending_.erase(*old);
    }
  } else if (const auto* news = std::get_if<InstanceNews>(&entry.sample)) {
    // An instance that is gone may still be heard of: its last replies come on another way.
    if (news->change == Change::ready) {
      uuid_of_instance_.insert_or_assign(news->identity.id, news->identity.uuid);
    } else if (news->change == Change::gone && uuid_of_instance_.contains(news->identity.id)) {
      gone_.push_back(news->identity.id);
      if (gone_.size() > most_gone) {
        uuid_of_instance_.erase(gone_.front());
        gone_.pop_front();
      }
    }
  }
}

}  // namespace millrace::fabric::observer
