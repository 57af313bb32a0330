#include "tools/recording/channels.hpp"

#include <array>

#include <fmt/format.h>

namespace millrace::tools::recording {

namespace {

struct Origin {
  const char* topic;
  const char* type;
  const char* qos;
};

constexpr const char* last_of_each_key = "reliable, transient local, keep last 1";
constexpr const char* last_calls = "reliable, transient local, keep last 128";

/// In the order of the alternatives of Sample; as writers have it (fabric/wire, which a test
/// compares).
constexpr std::array<Origin, std::variant_size_v<Sample>> origins{{
    {"millrace/v4/request", "millrace::Request", last_calls},
    {"millrace/v4/reply", "millrace::Reply", last_calls},
    {"millrace/v4/request", "millrace::Request", last_calls},
    {"millrace/v4/channel", "millrace::ChannelStatus", last_of_each_key},
    {"DCPSSubscription", "user data of the request reader", ""},
    {"millrace/v4/heartbeat", "millrace::Heartbeat", "best effort, volatile, keep last 1"},
    {"millrace/event", "millrace::Event", "reliable, volatile, keep last 8192"},
    {"millrace/command", "millrace::Command", "reliable, volatile, keep last 16"},
    {"millrace/outcome", "millrace::Outcome", "reliable, transient local, keep last 256"},
    {"millrace/v4/machine", "millrace::MachineStatus", last_of_each_key},
    {"millrace/data", "millrace::DataSample", "reliable, transient local, keep last 32"},
    {"millrace/program", "millrace::ProgramEvent", last_calls},
    {"millrace/alarm", "millrace::Alarm", last_of_each_key},
}};

}  // namespace

std::string topic_of(const Entry& entry) {
  if (std::holds_alternative<fabric::Command>(entry.sample) ||
      std::holds_alternative<fabric::Outcome>(entry.sample)) {
    return fmt::format("operator/{}", kind_of(entry));
  }
  if (const auto* status = std::get_if<fabric::MachineStatus>(&entry.sample)) {
    return fmt::format("machine/{}/status", status->machine);
  }
  if (const auto* news = std::get_if<AlarmNews>(&entry.sample)) {
    const std::string& program = news->alarm.program;
    return fmt::format("program/{}/alarm", program.empty() ? "unknown" : program);
  }
  if (const auto* data = std::get_if<fabric::DataSample>(&entry.sample)) {
    return fmt::format("machine/{}/{}/data/{}", data->key.machine, data->key.channel, data->group);
  }
  if (const fabric::ChannelKey* key = channel_of(entry)) {
    return fmt::format("machine/{}/{}/{}", key->machine, key->channel, kind_of(entry));
  }
  return fmt::format("service/{}/{}", entry.uuid.empty() ? "unknown" : entry.uuid, kind_of(entry));
}

mcap::StringMap origin_metadata(const Entry& entry) {
  const Origin& origin = origins.at(entry.sample.index());
  return {{"dds_topic", origin.topic}, {"dds_type", origin.type}, {"dds_qos", origin.qos}};
}

}  // namespace millrace::tools::recording
