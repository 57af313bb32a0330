#include "tools/recording/codec.hpp"

#include <array>
#include <utility>

#include <fmt/format.h>
#include <google/protobuf/descriptor.pb.h>

#include "fabric/encoding/plan.hpp"
#include "idl/recording.pb.h"

namespace millrace::tools::recording {

namespace {

/// The further members of an entry, in the same message as its sample.
struct Envelope {
  std::string uuid{};
  std::optional<std::uint32_t> text_size{};
};
MILLRACE_FIELDS(Envelope, uuid, text_size)

namespace pb = google::protobuf;
using fabric::encoding::Plan;

/// The message of a sample, and the DDS topic that it came from.
struct Kind {
  const char* message;
  const char* topic;
  const char* type;
  const char* qos;
};

constexpr const char* last_of_each_key = "reliable, transient local, keep last 1";
constexpr const char* last_calls = "reliable, transient local, keep last 16";

/// In the order of the alternatives of Sample; as writers have it (fabric/wire, which a test
/// compares).
constexpr std::array<Kind, std::variant_size_v<Sample>> kinds{{
    {"Request", "millrace/v5/request", "millrace::Request", last_calls},
    {"Reply", "millrace/v5/reply", "millrace::Reply", last_calls},
    {"Withdrawal", "millrace/v5/request", "millrace::Request", last_calls},
    {"ChannelStatus", "millrace/v5/channel", "millrace::ChannelStatus", last_of_each_key},
    {"Instance", "DCPSSubscription", "user data of the request reader", ""},
    {"InstanceStatus", "millrace/v5/heartbeat", "millrace::Heartbeat",
     "best effort, volatile, keep last 1"},
    {"Event", "millrace/v5/event", "millrace::Event", "reliable, volatile, keep last 8192"},
    {"Command", "millrace/v5/command", "millrace::Command", "reliable, volatile, keep last 16"},
    {"Outcome", "millrace/v5/outcome", "millrace::Outcome",
     "reliable, transient local, keep last 256"},
    {"MachineStatus", "millrace/v5/machine", "millrace::MachineStatus", last_of_each_key},
    {"DataSample", "millrace/v5/data", "millrace::DataSample",
     "reliable, transient local, keep last 32"},
    {"ProgramEvent", "millrace/v5/program", "millrace::ProgramEvent",
     "reliable, transient local, keep last 128"},
    {"Alarm", "millrace/v5/alarm", "millrace::Alarm", last_of_each_key},
}};

const pb::FileDescriptor& file() {
  return *millrace::recording::Request::descriptor()->file();
}

struct Message {
  std::string name;
  Plan sample;
  Plan envelope;
  Sample (*make)();
};

template <std::size_t index>
Message make_message() {
  using Value = std::variant_alternative_t<index, Sample>;
  const pb::Descriptor& descriptor = *file().FindMessageTypeByName(kinds[index].message);
  Plan sample(fabric::shape_of<Value>(), descriptor);
  Plan envelope(fabric::shape_of<Envelope>(), descriptor, &sample);
  return {descriptor.full_name(), std::move(sample), std::move(envelope),
          [] { return Sample(Value{}); }};
}

const std::array<Message, kinds.size()>& messages() {
  static const auto all = []<std::size_t... index>(std::index_sequence<index...>) {
    return std::array<Message, kinds.size()>{make_message<index>()...};
  }
  (std::make_index_sequence<kinds.size()>());
  return all;
}

/// The value that a Plan reads or writes.
template <typename Pointer, typename Its>
Pointer value_of(Its& sample) {
  return std::visit([](auto& value) -> Pointer { return &value; }, sample);
}

/// The type decides which of the three lists a value has, also if that is empty. Of a type that
/// only a later version knows, it is the one with elements.
void settle(fabric::DataSample& sample) {
  for (fabric::Value& value : sample.values) {
    if (value.type > fabric::ValueType::string) {
      continue;
    }
    const std::size_t wanted = value.type == fabric::ValueType::real64   ? 1
                               : value.type == fabric::ValueType::string ? 2
                                                                         : 0;
    if (value.elements.index() != wanted) {
      value.elements = wanted == 1   ? fabric::Elements(std::vector<double>())
                       : wanted == 2 ? fabric::Elements(std::vector<std::string>())
                                     : fabric::Elements(std::vector<std::int64_t>());
    }
  }
}

}  // namespace

std::string encode(const Entry& entry) {
  // Most messages fit.
  constexpr std::size_t usual = 192;
  const Message& message = messages()[entry.sample.index()];
  std::string out;
  out.reserve(usual);
  message.sample.write(value_of<const void*>(entry.sample), out);
  if (!message.envelope.is_empty()) {
    const Envelope envelope{entry.uuid, entry.withheld};
    message.envelope.write(&envelope, out);
  }
  return out;
}

std::string schema_name(const Entry& entry) {
  return messages()[entry.sample.index()].name;
}

const std::string& descriptor_set() {
  static const std::string bytes = [] {
    pb::FileDescriptorSet set;
    file().CopyTo(set.add_file());
    return set.SerializeAsString();
  }();
  return bytes;
}

tl::expected<Entry, std::string> decode(std::string_view schema, std::string_view bytes,
                                        fabric::Time at) {
  for (const Message& message : messages()) {
    if (message.name != schema) {
      continue;
    }
    Entry entry{.at = at, .sample = message.make()};
    Envelope envelope;
    if (!message.sample.read(value_of<void*>(entry.sample), bytes) ||
        !message.envelope.read(&envelope, bytes)) {
      return tl::unexpected(fmt::format("the message is not a {}", schema));
    }
    entry.uuid = std::move(envelope.uuid);
    entry.withheld = envelope.text_size;
    if (auto* data = std::get_if<fabric::DataSample>(&entry.sample)) {
      settle(*data);
    }
    std::visit(
        [&](const auto& value) {
          if constexpr (requires { value.uuid; }) {
            entry.uuid = fabric::canonical_uuid(value.uuid);
          } else if constexpr (requires { value.identity; }) {
            entry.uuid = value.identity.uuid;
          }
        },
        entry.sample);
    return entry;
  }
  return tl::unexpected(fmt::format("'{}' is not a schema of millrace", schema));
}

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
  const Kind& origin = kinds.at(entry.sample.index());
  return {{"dds_topic", origin.topic}, {"dds_type", origin.type}, {"dds_qos", origin.qos}};
}

}  // namespace millrace::tools::recording
