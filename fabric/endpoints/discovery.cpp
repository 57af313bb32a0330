#include "fabric/endpoints/discovery.hpp"

#include "base/messages/catalogue.hpp"
#include "base/text/quoted.hpp"
#include "fabric/dds/entity.hpp"
#include "fabric/dds/made_id.hpp"
#include "fabric/registry/identity.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::fabric::endpoints {

namespace {

using Endpoint = dds_builtintopic_endpoint_t;
using Seen = registry::InstanceRegistry::Seen;

/// A foreign name for a message; it may have 60 KiB and control characters.
std::string fit(const std::string& uuid) {
  return base::text::safe(uuid.size() <= max_text ? uuid : uuid.substr(0, max_text) + "...");
}

Discovery::Ignored full(const Message& what) {
  return {"full", what,
          base::messages::too_many_announced(registry::InstanceRegistry::most_endpoints, what)};
}

std::string user_data(const Endpoint& endpoint) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(endpoint.qos, &data, &size) || data == nullptr) {
    return {};
  }
  std::string text(static_cast<const char*>(data), size);
  dds_free(data);
  return text;
}

/// The one partition of an endpoint; empty if it has none or several.
std::string partition(const Endpoint& endpoint) {
  std::vector<std::string> all = dds::partitions_of(endpoint.qos);
  return all.size() == 1 ? std::move(all.front()) : std::string();
}

/// The user_data of a request reader; its partition decides the instance and the UUID.
tl::expected<InstanceIdentity, Message> identity_of(
    const std::string& text, const wire::RequestPartition& request_partition) {
  auto identity = registry::parse_identity(text);
  if (identity && identity->uuid != request_partition.uuid) {
    return tl::unexpected(
        base::messages::announces_other_uuid(fit(identity->uuid), fit(request_partition.uuid)));
  }
  if (identity && identity->id != request_partition.instance) {
    return tl::unexpected(base::messages::announces_other_instance(
        identity->id.to_string(), request_partition.instance.to_string()));
  }
  if (!identity) {
    return tl::unexpected(Message(identity.error()));
  }
  return std::move(*identity);
}

/// Neither reliable nor transient local, and with room for one sample: only its matches matter.
dds::Qos match_only_qos() {
  dds::Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(qos.get(), DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_resource_limits(qos.get(), 1, 1, 1);
  return qos;
}

}  // namespace

Discovery::Discovery(const dds::Participant& participant, Of of, dds::PostOnce* wake)
    : fabric_(participant.options().fabric), of_(of) {
  const dds::Listener on_data(dds_create_listener(nullptr));
  if (wake != nullptr) {
    wake->listen_for_data(on_data.get());
  }
  readers_ = dds::Entity(
      dds::check(dds_create_reader(participant.handle(), DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION,
                                   nullptr, on_data.get()),
                 "read DCPSSubscription"));
  writers_ = dds::Entity(
      dds::check(dds_create_reader(participant.handle(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr,
                                   on_data.get()),
                 "read DCPSPublication"));
  if (of == Of::calls || participant.authenticator() == nullptr) {
    return;
  }
  matches_.emplace([wake] {
    if (wake != nullptr) {
      wake->post();
    }
  });
  const dds::Listener on_match(dds_create_listener(nullptr));
  matches_->listen(on_match.get());
  replies_topic_ = wire::create_topic(participant, wire::reply_topic);
  replies_subscriber_ = wire::create_subscriber(participant, wire::all_services(fabric_));
  replies_ = dds::Entity(
      dds::check(dds_create_reader(replies_subscriber_.handle(), replies_topic_.handle(),
                                   match_only_qos().get(), on_match.get()),
                 "match writers of replies"));
}

Discovery::News Discovery::drain(registry::InstanceRegistry& registry, SteadyTime now) {
  if (matches_) {
    registry.match_readers();
  } else if (of_ == Of::tools) {
    registry.match_all();
  }
  News news;
  drain_readers(registry, now, news);
  drain_writers(registry, news);
  if (matches_) {
    for (const auto& [handle, is] : matches_->take()) {
      registry.matched(handle, is);
    }
  }
  return news;
}

void Discovery::drain_readers(registry::InstanceRegistry& registry, SteadyTime now, News& news) {
  const auto seen = [&](const Endpoint& endpoint, const dds_sample_info_t& info) {
    if (!info.valid_data || wire::instance_state_of(info) != wire::InstanceState::alive) {
      registry.endpoint_gone(info.instance_handle);
      return;
    }
    if (endpoint.topic_name != std::string_view(wire::request_topic.name)) {
      return;
    }
    const auto request_partition = wire::parse_request_partition(fabric_, partition(endpoint));
    const std::string text = user_data(endpoint);
    // A recorder reads requests too; it has no user_data.
    if (!request_partition || text.empty()) {
      return;
    }
    auto identity = identity_of(text, *request_partition);
    if (!identity) {
      news.ignored.push_back(
          {"identity", request_partition->instance.to_string(),
           base::messages::instance_ignored(fit(request_partition->uuid), identity.error())});
      return;
    }
    const bool made_id = dds::is_made_by(identity->id, endpoint.participant_key);
    switch (registry.reader_seen(
        info.instance_handle, {std::move(*identity), endpoint.participant_instance_handle, made_id},
        now)) {
      case Seen::taken:
        break;
      case Seen::second:
        news.ignored.push_back(
            {"second", request_partition->instance.to_string(),
             base::messages::announced_twice(request_partition->instance.to_string(),
                                             fit(request_partition->uuid))});
        break;
      case Seen::full:
        news.ignored.push_back(full(base::messages::request_readers()));
        break;
    }
  };
  while (wire::take_lent<Endpoint>(readers_.handle(), seen) > 0) {
  }
}

void Discovery::drain_writers(registry::InstanceRegistry& registry, News& news) {
  const auto seen = [&](const Endpoint& endpoint, const dds_sample_info_t& info) {
    if (info.valid_data && endpoint.topic_name == std::string_view(wire::reply_topic.name)) {
      const auto instance = registry::parse_instance(user_data(endpoint));
      const std::string where = partition(endpoint);
      if (instance && where.starts_with(fabric_ + "/") &&
          registry.writer_seen(info.instance_handle,
                               {*instance, endpoint.participant_instance_handle,
                                where.substr(fabric_.size() + 1)}) == Seen::full) {
        news.ignored.push_back(full(base::messages::reply_writers()));
      }
    }
    if (info.valid_data && endpoint.topic_name == std::string_view(wire::heartbeat_topic.name)) {
      registry.heartbeat_writer_seen(info.instance_handle, endpoint.participant_instance_handle);
    }
    // One that came and left in between did exist: its last samples may still be untaken.
    if (!info.valid_data || wire::instance_state_of(info) != wire::InstanceState::alive) {
      registry.endpoint_gone(info.instance_handle);
    }
  };
  while (wire::take_lent<Endpoint>(writers_.handle(), seen) > 0) {
  }
}

}  // namespace millrace::fabric::endpoints
