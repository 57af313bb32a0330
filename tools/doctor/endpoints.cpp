#include "tools/doctor/endpoints.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/text/number.hpp"
#include "fabric/wire/topics.hpp"

namespace millrace::tools::doctor {

namespace {

using fabric::wire::Keep;

const fabric::wire::Topic* topic_named(const std::string& name) {
  static const std::array<const fabric::wire::Topic*, 9> topics{
      &fabric::wire::request_topic,   &fabric::wire::reply_topic,   &fabric::wire::channel_topic,
      &fabric::wire::heartbeat_topic, &fabric::wire::machine_topic, &fabric::wire::event_topic,
      &fabric::wire::command_topic,   &fabric::wire::outcome_topic, &fabric::wire::alarm_topic};
  const auto* const found = std::ranges::find_if(
      topics, [&](const fabric::wire::Topic* topic) { return topic->name == name; });
  return found == topics.end() ? nullptr : *found;
}

/// "millrace" of "millrace", "millrace/560a…" and "millrace/*".
std::string fabric_of(const std::string& partition) {
  return partition.substr(0, partition.find('/'));
}

bool is_in(const SeenEndpoint& endpoint, const std::string& fabric) {
  return std::ranges::any_of(endpoint.partitions, [&](const std::string& partition) {
    return fabric_of(partition) == fabric;
  });
}

std::string text_of(const Directory& directory, Handle participant) {
  const auto found = directory.participants().find(participant);
  if (found == directory.participants().end()) {
    return "a program";
  }
  const Announcement& who = found->second.who;
  return fmt::format("{}{}{}", who.name.empty() ? who.process : who.name,
                     who.host.empty() ? "" : " on " + who.host,
                     who.pid.empty() ? "" : ", pid " + who.pid);
}

bool is_own(const Directory& directory, const SeenEndpoint& endpoint) {
  const auto found = directory.participants().find(endpoint.participant);
  return found != directory.participants().end() && found->second.self;
}

/// Compared with the endpoint of a millrace process at the other end.
std::vector<std::string> reasons_of(const SeenEndpoint& endpoint, const fabric::wire::Topic& topic,
                                    bool matched) {
  const EndpointQos ours = endpoint.writer
                               ? qos_of(*fabric::wire::reader_qos(topic, Keep::last), false)
                               : qos_of(*fabric::wire::writer_qos(topic), true);
  std::vector<std::string> reasons =
      endpoint.writer ? misfits(endpoint.qos, ours) : misfits(ours, endpoint.qos);
  if (endpoint.type != topic.type->m_typename) {
    reasons.push_back(fmt::format("its type is {}, not {}", endpoint.type, topic.type->m_typename));
  }
  if (reasons.empty() && endpoint.writer && !matched) {
    reasons.emplace_back("its type has the same name but other members: another version");
  }
  return reasons;
}

}  // namespace

TopicReaders::TopicReaders(const fabric::dds::Participant& participant)
    : requests_(participant, fabric::wire::all_services(participant.options().fabric), Keep::last),
      replies_(participant, fabric::wire::all_services(participant.options().fabric), Keep::last),
      heartbeats_(participant, participant.options().fabric, Keep::last),
      channels_(participant, participant.options().fabric, Keep::last),
      machines_(participant, participant.options().fabric, Keep::last),
      events_(participant, participant.options().fabric, Keep::last),
      commands_(participant, participant.options().fabric, Keep::last),
      outcomes_(participant, participant.options().fabric, Keep::last),
      alarms_(participant, participant.options().fabric, Keep::last) {}

std::set<Handle> TopicReaders::matched() const {
  std::set<Handle> all;
  const auto add = [&](const auto& reader) {
    const auto handles = reader.matched();
    all.insert(handles.begin(), handles.end());
  };
  add(requests_);
  add(replies_);
  add(heartbeats_);
  add(channels_);
  add(machines_);
  add(events_);
  add(commands_);
  add(outcomes_);
  add(alarms_);
  return all;
}

namespace {

/// The wire version in the names of its topics; nullopt if none of them has one.
std::optional<std::uint32_t> version_of(std::string_view topic) {
  constexpr std::array first{"millrace/request", "millrace/reply", "millrace/instance"};
  if (std::ranges::find(first, topic) != first.end()) {
    return 1;
  }
  constexpr std::string_view prefix = "millrace/v";
  if (!topic.starts_with(prefix)) {
    return std::nullopt;
  }
  topic.remove_prefix(prefix.size());
  return base::text::parse_number<std::uint32_t>(topic.substr(0, topic.find('/')));
}

}  // namespace

std::vector<Misfit> misfits_in(const Directory& directory, const std::set<Handle>& matched,
                               const std::string& fabric) {
  std::vector<Misfit> all;
  std::set<std::pair<Handle, std::uint32_t>> told;
  for (const auto& [handle, endpoint] : directory.endpoints()) {
    const fabric::wire::Topic* topic = topic_named(endpoint.topic);
    const auto version = version_of(endpoint.topic);
    if (topic == nullptr && version && is_in(endpoint, fabric) &&
        told.emplace(endpoint.participant, *version).second) {
      all.push_back({endpoint.topic,
                     endpoint.writer,
                     text_of(directory, endpoint.participant),
                     {fmt::format("it uses wire version {}, this is version {}: they do not "
                                  "receive each other's calls; install one version everywhere",
                                  *version, fabric::wire::wire_version)}});
    }
    if (topic == nullptr || !is_in(endpoint, fabric) || is_own(directory, endpoint)) {
      continue;
    }
    auto reasons = reasons_of(endpoint, *topic, matched.contains(handle));
    if (!reasons.empty()) {
      all.push_back({endpoint.topic, endpoint.writer, text_of(directory, endpoint.participant),
                     std::move(reasons)});
    }
  }
  return all;
}

std::vector<Program> programs_in(const Directory& directory, const std::string& fabric,
                                 const fabric::dds::Authenticator* authenticator) {
  std::map<Handle, Program> programs;
  for (const auto& [handle, participant] : directory.participants()) {
    programs.emplace(handle,
                     Program{.prefix = participant.who.prefix,
                             .name = participant.who.name.empty() ? participant.who.process
                                                                  : participant.who.name,
                             .host = participant.who.host,
                             .pid = participant.who.pid,
                             .addresses = participant.addresses,
                             .self = participant.self,
                             .announces_identity = authenticator == nullptr || participant.self ||
                                                   authenticator->look_up(handle).status.identity});
  }
  for (const auto& [handle, endpoint] : directory.endpoints()) {
    const auto program = programs.find(endpoint.participant);
    if (program == programs.end()) {
      continue;
    }
    for (const std::string& partition : endpoint.partitions) {
      program->second.fabrics.insert(fabric_of(partition));
      const auto request_partition = fabric::wire::parse_request_partition(fabric, partition);
      if (request_partition && !endpoint.writer &&
          endpoint.topic == fabric::wire::request_topic.name && !endpoint.user_data.empty()) {
        program->second.serves.insert(request_partition->uuid);
      }
    }
    if (endpoint.writer && endpoint.topic == fabric::wire::machine_topic.name &&
        is_in(endpoint, fabric)) {
      program->second.is_gateway = true;
    }
  }
  std::vector<Program> all;
  all.reserve(programs.size());
  for (auto& [handle, program] : programs) {
    all.push_back(std::move(program));
  }
  return all;
}

}  // namespace millrace::tools::doctor
