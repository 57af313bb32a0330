#include "tools/doctor/directory.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "fabric/participant_identity.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::tools::doctor {

namespace {

template <std::size_t size>
std::string pick(const std::array<const char*, size>& names, std::uint32_t index) {
  return index < size ? names.at(index) : "unknown";
}

std::string durability(std::uint32_t kind) {
  return pick<4>({"volatile", "transient local", "transient", "persistent"}, kind);
}

std::string liveliness(std::uint32_t kind) {
  return pick<3>({"automatic", "manual by participant", "manual by topic"}, kind);
}

std::string duration(std::int64_t nanoseconds) {
  return nanoseconds == DDS_INFINITY ? "none"
                                     : fmt::format("{} ms", static_cast<double>(nanoseconds) / 1e6);
}

base::messages::Message misfit(const char* policy, const std::string& offered,
                               const std::string& requested) {
  return base::messages::qos_differs(policy, offered, requested);
}

}  // namespace

EndpointQos qos_of(const dds_qos_t& qos, bool of_writer) {
  EndpointQos result;
  dds_reliability_kind_t reliability{};
  dds_duration_t ignored{};
  result.reliable = dds_qget_reliability(&qos, &reliability, &ignored)
                        ? reliability == DDS_RELIABILITY_RELIABLE
                        : of_writer;
  dds_durability_kind_t durability_kind{};
  if (dds_qget_durability(&qos, &durability_kind)) {
    result.durability = durability_kind;
  }
  dds_qget_deadline(&qos, &result.deadline);
  dds_qget_latency_budget(&qos, &result.latency_budget);
  dds_ownership_kind_t ownership{};
  result.exclusive = dds_qget_ownership(&qos, &ownership) && ownership == DDS_OWNERSHIP_EXCLUSIVE;
  dds_liveliness_kind_t liveliness_kind{};
  if (dds_qget_liveliness(&qos, &liveliness_kind, &result.lease)) {
    result.liveliness = liveliness_kind;
  }
  dds_destination_order_kind_t order{};
  result.by_source_time =
      dds_qget_destination_order(&qos, &order) && order == DDS_DESTINATIONORDER_BY_SOURCE_TIMESTAMP;
  return result;
}

std::vector<base::messages::Message> misfits(const EndpointQos& offered,
                                             const EndpointQos& requested) {
  std::vector<base::messages::Message> found;
  if (requested.reliable && !offered.reliable) {
    found.push_back(misfit("reliability", "best effort", "reliable"));
  }
  if (requested.durability > offered.durability) {
    found.push_back(
        misfit("durability", durability(offered.durability), durability(requested.durability)));
  }
  if (requested.deadline < offered.deadline) {
    found.push_back(misfit("deadline", duration(offered.deadline), duration(requested.deadline)));
  }
  if (requested.latency_budget < offered.latency_budget) {
    found.push_back(misfit("latency budget", duration(offered.latency_budget),
                           duration(requested.latency_budget)));
  }
  if (requested.exclusive != offered.exclusive) {
    found.push_back(misfit("ownership", offered.exclusive ? "exclusive" : "shared",
                           requested.exclusive ? "exclusive" : "shared"));
  }
  if (requested.liveliness > offered.liveliness) {
    found.push_back(
        misfit("liveliness", liveliness(offered.liveliness), liveliness(requested.liveliness)));
  }
  if (requested.lease < offered.lease) {
    found.push_back(misfit("liveliness lease", duration(offered.lease), duration(requested.lease)));
  }
  if (requested.by_source_time && !offered.by_source_time) {
    found.push_back(misfit("destination order", "by reception", "by source time"));
  }
  return found;
}

namespace {

constexpr std::string_view topics_of_ours = "millrace/";

/// Copies a string that Cyclone has allocated, and frees it.
std::string taken(char* text) {
  std::string copy = text != nullptr ? text : "";
  dds_free(text);
  return copy;
}

std::string property(const dds_qos_t* qos, const char* name) {
  char* value = nullptr;
  return dds_qget_prop(qos, name, &value) ? taken(value) : std::string();
}

/// "udp/10.77.0.1:7410", without Cyclone's number of the interface ("@2"); empty for this process.
std::string addresses_in(std::string text) {
  for (std::size_t at = text.find('@'); at != std::string::npos; at = text.find('@', at)) {
    text.erase(at, text.find_first_not_of("0123456789", at + 1) - at);
  }
  return text == "localprocess" ? "" : text;
}

std::string entity_name(const dds_qos_t* qos) {
  char* name = nullptr;
  return dds_qget_entity_name(qos, &name) ? taken(name) : std::string();
}

std::string user_data(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  std::string text;
  if (dds_qget_userdata(qos, &data, &size) && size > 0) {
    text.assign(static_cast<const char*>(data), size);
  }
  dds_free(data);
  return text;
}

fabric::dds::Entity builtin_reader(const fabric::dds::Participant& participant, dds_entity_t topic,
                                   const char* what) {
  return fabric::dds::Entity(
      fabric::dds::check(dds_create_reader(participant.handle(), topic, nullptr, nullptr), what));
}

bool is_gone(const dds_sample_info_t& info) {
  return !info.valid_data ||
         fabric::wire::instance_state_of(info) != fabric::wire::InstanceState::alive;
}

}  // namespace

Directory::Directory(const fabric::dds::Participant& participant)
    : participant_reader_(
          builtin_reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, "read DCPSParticipant")),
      subscriptions_(
          builtin_reader(participant, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, "read DCPSSubscription")),
      publications_(
          builtin_reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION, "read DCPSPublication")) {
  fabric::dds::check(dds_get_guid(participant.handle(), &own_), "learn the own GUID");
}

void Directory::drain() {
  drain_participants();
  drain_endpoints(subscriptions_.handle(), false);
  drain_endpoints(publications_.handle(), true);
  for (const auto& [handle, endpoint] : endpoints_) {
    const auto owner = participants_.find(endpoint.participant);
    if (endpoint.topic != fabric::identity_topic_name || owner == participants_.end()) {
      continue;
    }
    if (const auto where = fabric::parse_process_info(endpoint.user_data)) {
      Announcement& who = owner->second.who;
      who.name = where->program;
      who.host = where->host;
      who.pid = std::to_string(where->pid);
      owner->second.version = where->version;
    }
  }
}

void Directory::drain_participants() {
  const auto use = [&](const dds_builtintopic_participant_t& sample,
                       const dds_sample_info_t& info) {
    if (is_gone(info)) {
      participants_.erase(info.instance_handle);
      return;
    }
    SeenParticipant& seen = participants_[info.instance_handle];
    std::copy_n(std::begin(sample.key.v), seen.who.prefix.size(), seen.who.prefix.begin());
    seen.who.name = entity_name(sample.qos);
    seen.who.host = property(sample.qos, "__Hostname");
    seen.who.process = property(sample.qos, "__ProcessName");
    seen.who.pid = property(sample.qos, "__Pid");
    seen.addresses = addresses_in(property(sample.qos, "__NetworkAddresses"));
    seen.version = fabric::parse_process_version(user_data(sample.qos));
    seen.self = std::memcmp(sample.key.v, own_.v, sizeof own_.v) == 0;
  };
  while (fabric::wire::take_lent<dds_builtintopic_participant_t>(participant_reader_.handle(),
                                                                 use) > 0) {
  }
}

void Directory::drain_endpoints(dds_entity_t reader, bool writers) {
  const auto use = [&](const dds_builtintopic_endpoint_t& sample, const dds_sample_info_t& info) {
    if (is_gone(info)) {
      endpoints_.erase(info.instance_handle);
      return;
    }
    if (!std::string_view(sample.topic_name).starts_with(topics_of_ours)) {
      return;
    }
    endpoints_.insert_or_assign(info.instance_handle,
                                SeenEndpoint{.participant = sample.participant_instance_handle,
                                             .writer = writers,
                                             .topic = sample.topic_name,
                                             .type = sample.type_name,
                                             .partitions = fabric::dds::partitions_of(sample.qos),
                                             .user_data = user_data(sample.qos),
                                             .qos = qos_of(*sample.qos, writers)});
  };
  while (fabric::wire::take_lent<dds_builtintopic_endpoint_t>(reader, use) > 0) {
  }
}

}  // namespace millrace::tools::doctor
