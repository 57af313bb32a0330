#include "fabric/wire/topics.hpp"

#include <fmt/format.h>

#include "idl/alarm.h"
#include "idl/data.h"
#include "idl/millrace.h"
#include "idl/variables.h"

namespace millrace::fabric::wire {

namespace {

constexpr std::int32_t last_only = 1;

/// A reader keeps one history for each key, of all writers. With a depth of 1, a participant that
/// often writes another's key would replace that sample before the reader takes it.
constexpr std::int32_t last_of_a_key = 32;

/// Requests of one channel, and replies to it by one instance: a slow recorder, or one that
/// discovers the writer only now, gets them although the calls are over. While a writer is busy (no
/// 160 ms without a write) Cyclone never asks its readers what they have received, so it keeps this
/// many of each key. Half as many are too few for five calls and their withdrawals.
constexpr std::int32_t calls_in_flight = 16;

/// The event topic has no key, so the depth is what may be on its way at once.
constexpr std::int32_t events_in_flight = 8192;

/// This one has no key either: an operator sends commands one by one.
constexpr std::int32_t commands_in_flight = 16;

/// Outcomes of commands and of each written variable.
constexpr std::int32_t outcomes_in_flight = 256;

/// Of one group of data: what a recorder may be behind. At 100 heartbeats a second that is a third
/// of one.
constexpr std::int32_t heartbeats_in_flight = 32;

/// Of one channel: programs come one after the other, and short ones many in a second.
constexpr std::int32_t program_events_in_flight = 128;

/// Requests of one requester that may be unread.
constexpr std::int32_t questions_in_flight = 64;

/// Should a write ever have to wait for a reader, it fails instead.
constexpr dds_duration_t never_wait = 0;

dds::Qos common_qos(const Topic& topic, std::string_view user_data) {
  dds::Qos qos(dds_create_qos());
  dds_qset_reliability(qos.get(),
                       topic.best_effort ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE,
                       never_wait);
  dds_qset_durability(
      qos.get(), topic.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (!user_data.empty()) {
    dds_qset_userdata(qos.get(), user_data.data(), user_data.size());
  }
  return qos;
}

}  // namespace

// A writer sends to one instance: its keys are the channels of the requester.
const Topic request_topic{
    "millrace/v5/request", &millrace_Request_desc, true, calls_in_flight, false, 4'096};
// Far more than an instance keeps for later readers (fabric/endpoints/reply_endpoint.cpp).
const Topic reply_topic{
    "millrace/v5/reply", &millrace_Reply_desc, true, calls_in_flight, false, 8'192};
const Topic channel_topic{
    "millrace/v5/channel", &millrace_ChannelStatus_desc, true, last_only, false, 16'384};
// A process sends its own heartbeats, with its own writer.
const Topic heartbeat_topic{
    "millrace/v5/heartbeat", &millrace_Heartbeat_desc, false, last_only, true, 4};
const Topic machine_topic{
    "millrace/v5/machine", &millrace_MachineStatus_desc, true, last_only, false, 1'024};
const Topic event_topic{"millrace/v5/event", &millrace_Event_desc, false, events_in_flight};
const Topic command_topic{"millrace/v5/command", &millrace_Command_desc, false, commands_in_flight};
const Topic outcome_topic{
    "millrace/v5/outcome", &millrace_Outcome_desc, true, outcomes_in_flight, false, 1'024};
const Topic alarm_topic{"millrace/v5/alarm", &millrace_Alarm_desc, true, last_only, false, 1'024};
const Topic data_topic{
    "millrace/v5/data", &millrace_DataSample_desc, true, heartbeats_in_flight, false, 4'096};
const Topic program_topic{"millrace/v5/program",
                          &millrace_ProgramEvent_desc,
                          true,
                          program_events_in_flight,
                          false,
                          4'096};
const Topic variable_request_topic{"millrace/v5/variable/request", &millrace_VariableRequest_desc,
                                   false, questions_in_flight};
const Topic variable_reply_topic{"millrace/v5/variable/reply", &millrace_VariableReply_desc, true,
                                 questions_in_flight};

dds::Qos writer_qos(const Topic& topic, std::string_view user_data) {
  dds::Qos qos = common_qos(topic, user_data);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, topic.writer_depth);
  // Later readers get the last sample of each key, and none that others have only not acknowledged
  // yet.
  dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, last_only, DDS_LENGTH_UNLIMITED,
                              DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  // A withdrawal is explicit (Writer::withdraw). The samples of a writer that ended unexpectedly
  // are not withdrawn: a service continues the call, and its gateway comes back for the answer.
  dds_qset_writer_data_lifecycle(qos.get(), false);
  return qos;
}

dds::Qos reader_qos(const Topic& topic, Keep keep, std::string_view user_data) {
  dds::Qos qos = common_qos(topic, user_data);
  if (keep == Keep::all) {
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_ALL, DDS_LENGTH_UNLIMITED);
  } else {
    dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, last_of_a_key);
  }
  return qos;
}

dds::Qos partition_qos(const std::string& partition) {
  dds::Qos qos(dds_create_qos());
  dds_qset_partition1(qos.get(), partition.c_str());
  return qos;
}

std::string fabric_of(std::string_view partition) {
  return std::string(partition.substr(0, partition.find('/')));
}

std::string service_partition(std::string_view fabric, std::string_view canonical_uuid) {
  return fmt::format("{}/{}", fabric, canonical_uuid);
}

std::string request_partition(std::string_view fabric, std::string_view canonical_uuid,
                              const InstanceId& instance) {
  return fmt::format("{}/{}/{}", fabric, canonical_uuid, instance.to_string());
}

std::string requester_partition(std::string_view fabric, const InstanceId& requester) {
  return fmt::format("{}/{}", fabric, requester.to_string());
}

std::string all_services(std::string_view fabric) {
  return fmt::format("{}/*", fabric);
}

std::optional<RequestPartition> parse_request_partition(std::string_view fabric,
                                                        std::string_view partition) {
  if (partition.size() < fabric.size() + 2 || !partition.starts_with(fabric) ||
      partition[fabric.size()] != '/' || partition.find_first_of("*?") != std::string_view::npos) {
    return std::nullopt;
  }
  partition.remove_prefix(fabric.size() + 1);
  // An identifier that is not a UUID may have slashes in it.
  const auto end = partition.rfind('/');
  if (end == std::string_view::npos || end == 0) {
    return std::nullopt;
  }
  const auto instance = InstanceId::parse(partition.substr(end + 1));
  if (!instance) {
    return std::nullopt;
  }
  return RequestPartition{std::string(partition.substr(0, end)), *instance};
}

}  // namespace millrace::fabric::wire
