#include "fabric/endpoints/discovery.hpp"

#include <fmt/format.h>

#include "fabric/registry/identity.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::fabric::endpoints {

namespace {

using Endpoint = dds_builtintopic_endpoint_t;
using Seen = registry::InstanceRegistry::Seen;

/// A foreign name shortened for a message; it may have 60 KiB.
std::string fit(const std::string& uuid) {
  return uuid.size() <= max_text ? uuid : uuid.substr(0, max_text) + "...";
}

Discovery::Ignored full(std::string_view what) {
  return {"full", std::string(what),
          fmt::format("more than {} {} are announced on this fabric; further ones are ignored "
                      "until they announce themselves again",
                      registry::InstanceRegistry::most_endpoints, what)};
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
  std::uint32_t count = 0;
  char** names = nullptr;
  if (!dds_qget_partition(endpoint.qos, &count, &names)) {
    return {};
  }
  std::string only = count == 1 ? names[0] : "";
  for (std::uint32_t i = 0; i < count; ++i) {
    dds_free(names[i]);
  }
  dds_free(names);
  return only;
}

/// The user_data of a request reader; its partition decides the instance and the UUID.
tl::expected<InstanceIdentity, std::string> identity_of(
    const std::string& text, const wire::RequestPartition& request_partition) {
  auto identity = registry::parse_identity(text);
  if (identity && identity->uuid != request_partition.uuid) {
    return tl::unexpected(fmt::format("its user_data has UUID {}, but it reads the partition of {}",
                                      identity->uuid, fit(request_partition.uuid)));
  }
  if (identity && identity->id != request_partition.instance) {
    return tl::unexpected(
        fmt::format("its user_data has instance {}, but it reads the partition of {}",
                    identity->id.to_string(), request_partition.instance.to_string()));
  }
  return identity;
}

}  // namespace

Discovery::Discovery(const dds::Participant& participant, const dds_listener_t* listener)
    : fabric_(participant.options().fabric),
      readers_(dds::check(dds_create_reader(participant.handle(),
                                            DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, listener),
                          "read DCPSSubscription")),
      writers_(dds::check(dds_create_reader(participant.handle(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION,
                                            nullptr, listener),
                          "read DCPSPublication")) {}

Discovery::News Discovery::drain(registry::InstanceRegistry& registry, SteadyTime now) {
  News news;
  drain_readers(registry, now, news);
  drain_writers(registry, news);
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
      news.ignored.push_back({"identity", request_partition->instance.to_string(),
                              fmt::format("an instance that serves {} is ignored: {}",
                                          fit(request_partition->uuid), identity.error())});
      return;
    }
    switch (registry.reader_seen(
        info.instance_handle, {std::move(*identity), endpoint.participant_instance_handle}, now)) {
      case Seen::taken:
        news.request_partitions.push_back(*request_partition);
        break;
      case Seen::second:
        news.ignored.push_back(
            {"second", request_partition->instance.to_string(),
             fmt::format("two processes announce instance {} of {}; the second one is ignored "
                         "while the first one runs",
                         request_partition->instance.to_string(), fit(request_partition->uuid))});
        break;
      case Seen::full:
        news.ignored.push_back(full("request readers"));
        break;
    }
  };
  while (wire::take_lent<Endpoint>(readers_.handle(), seen) > 0) {
  }
}

void Discovery::drain_writers(registry::InstanceRegistry& registry, News& news) {
  const auto seen = [&](const Endpoint& endpoint, const dds_sample_info_t& info) {
    if (info.valid_data && endpoint.topic_name == std::string_view(wire::reply_topic.name)) {
      if (const auto instance = registry::parse_instance(user_data(endpoint))) {
        if (registry.writer_seen(info.instance_handle,
                                 {*instance, endpoint.participant_instance_handle}) == Seen::full) {
          news.ignored.push_back(full("reply writers"));
        }
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
