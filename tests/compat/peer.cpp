#include "tests/compat/peer.hpp"

#include <fmt/format.h>

#include "tests/support/await.hpp"

namespace millrace::tests::compat {

millrace_Extras later_extras() {
  static millrace_Extra extra = [] {
    millrace_Extra entry{};
    put(entry.name, later_name);
    put(entry.bytes, later_bytes);
    return entry;
  }();
  return {._maximum = 1, ._length = 1, ._buffer = &extra, ._release = false};
}

millrace_Message later_message() {
  static std::array<millrace_MessagePart, 2> parts = [] {
    std::array<millrace_MessagePart, 2> both{};
    put(both[0].code, "later_sentence");
    both[0].arguments = 1;
    put(both[0].text, later_sentence);
    put(both[1].text, "T7");
    return both;
  }();
  return {._maximum = 2, ._length = 2, ._buffer = parts.data(), ._release = false};
}

Id id_of(std::uint8_t number) {
  return {0x8d, 0x0c, 0x4e, 0x6a, 0x52, 0xf3, 0x4f, 0x0e, 0x9d, 0x1b, 0, 0, 0, 0, 0, number};
}

std::string text_of(const Id& id) {
  std::string text;
  for (std::size_t i = 0; i < id.size(); ++i) {
    text += fmt::format("{}{:02x}", i == 4 || i == 6 || i == 8 || i == 10 ? "-" : "", id[i]);
  }
  return text;
}

Id id_in(const std::string& text) {
  Id id{};
  std::string digits = text;
  std::erase(digits, '-');
  for (std::size_t i = 0; i < id.size(); ++i) {
    id[i] = static_cast<std::uint8_t>(std::stoi(digits.substr(2 * i, 2), nullptr, 16));
  }
  return id;
}

#define MILLRACE_TOPIC_OF_1_0(Type, name, ...)                                \
  template <>                                                                 \
  const TopicOf10& topic_of<millrace_##Type>() {                              \
    static const TopicOf10 topic{name, &millrace_##Type##_desc, __VA_ARGS__}; \
    return topic;                                                             \
  }
MILLRACE_TOPIC_OF_1_0(Request, "millrace/v5/request")
MILLRACE_TOPIC_OF_1_0(Reply, "millrace/v5/reply", true, true, 16)
MILLRACE_TOPIC_OF_1_0(Heartbeat, "millrace/v5/heartbeat", false, false)
MILLRACE_TOPIC_OF_1_0(ChannelStatus, "millrace/v5/channel")
MILLRACE_TOPIC_OF_1_0(MachineStatus, "millrace/v5/machine")
MILLRACE_TOPIC_OF_1_0(Event, "millrace/v5/event", true, false, 64)
MILLRACE_TOPIC_OF_1_0(DataSample, "millrace/v5/data")
MILLRACE_TOPIC_OF_1_0(ProgramEvent, "millrace/v5/program")
MILLRACE_TOPIC_OF_1_0(Alarm, "millrace/v5/alarm")
MILLRACE_TOPIC_OF_1_0(Command, "millrace/v5/command", true, false, 16)
MILLRACE_TOPIC_OF_1_0(Outcome, "millrace/v5/outcome")
MILLRACE_TOPIC_OF_1_0(VariableRequest, "millrace/v5/variable/request", true, false, 64)
MILLRACE_TOPIC_OF_1_0(VariableReply, "millrace/v5/variable/reply", true, true, 64)
#undef MILLRACE_TOPIC_OF_1_0

namespace {

/// On the loopback interface. Tools announce themselves to the multicast group.
constexpr const char* configuration =
    R"(<General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>)"
    R"(<AllowMulticast>spdp</AllowMulticast></General>)"
    R"(<Internal><GenerateKeyhash>true</GenerateKeyhash></Internal>)";

dds_qos_t* qos_of(const TopicOf10& topic, const std::string& user_data) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(
      qos, topic.is_reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_durability(
      qos, topic.is_transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, topic.depth);
  dds_qset_writer_data_lifecycle(qos, false);
  if (!user_data.empty()) {
    dds_qset_userdata(qos, user_data.data(), user_data.size());
  }
  return qos;
}

using Create = dds_entity_t(dds_entity_t, const dds_qos_t*, const dds_listener_t*);
using Open = dds_entity_t(dds_entity_t, dds_entity_t, const dds_qos_t*, const dds_listener_t*);

dds_entity_t open_in(dds_entity_t participant, const TopicOf10& topic, const std::string& partition,
                     const std::string& user_data, Create* create, Open* open) {
  dds_qos_t* const of_group = dds_create_qos();
  dds_qset_partition1(of_group, partition.c_str());
  const dds_entity_t group = checked(create(participant, of_group, nullptr), "create a group");
  dds_delete_qos(of_group);
  const dds_entity_t described =
      checked(dds_create_topic(participant, topic.type, topic.name, nullptr, nullptr), topic.name);
  dds_qos_t* const qos = qos_of(topic, user_data);
  const dds_entity_t opened = checked(open(group, described, qos, nullptr), topic.name);
  dds_delete_qos(qos);
  return opened;
}

}  // namespace

Peer::Peer(std::uint32_t domain, const std::string& announced)
    : domain_(checked(dds_create_domain(domain, configuration), "create the domain")) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_userdata(qos, announced.data(), announced.size());
  participant_ = checked(dds_create_participant(domain, qos, nullptr), "join");
  dds_delete_qos(qos);
}

Peer::~Peer() {
  dds_delete(participant_);
  dds_delete(domain_);
}

dds_entity_t Peer::open_writer(const TopicOf10& topic, const std::string& partition,
                               const std::string& user_data) const {
  return open_in(participant_, topic, partition, user_data, &dds_create_publisher,
                 &dds_create_writer);
}

dds_entity_t Peer::open_reader(const TopicOf10& topic, const std::string& partition,
                               const std::string& user_data) const {
  return open_in(participant_, topic, partition, user_data, &dds_create_subscriber,
                 &dds_create_reader);
}

std::string Peer::find_instance(const std::string& uuid) const {
  const dds_entity_t readers =
      checked(dds_create_reader(participant_, DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, nullptr, nullptr),
              "read announcements");
  std::string instance;
  await("an instance of " + uuid, [&] {
    std::array<void*, 1> samples{};
    std::array<dds_sample_info_t, 1> infos{};
    const dds_return_t count = dds_take(readers, samples.data(), infos.data(), 1, 1);
    if (count == 1 && infos[0].valid_data) {
      const auto& reader = *static_cast<const dds_builtintopic_endpoint_t*>(samples[0]);
      void* data = nullptr;
      std::size_t size = 0;
      if (dds_qget_userdata(reader.qos, &data, &size) && data != nullptr) {
        const std::string text(static_cast<const char*>(data), size);
        const auto id = text.find("\nid=");
        if (id != std::string::npos && text.find("\nuuid=" + uuid) != std::string::npos) {
          instance = text.substr(id + 4, 36);
        }
        dds_free(data);
      }
    }
    if (count > 0) {
      dds_return_loan(readers, samples.data(), count);
    }
    return !instance.empty();
  });
  return instance;
}

namespace {

std::string announcement(const std::string& uuid, const std::string& further) {
  return fmt::format(
      "millrace-instance 2\nid={}\nuuid={}\nname=later\nhost=later-pc\npid=1\nlease_ms=1500\n{}",
      text_of(Service::id()), uuid, further);
}

}  // namespace

Service::Service(const Peer& peer, const std::string& uuid, const std::string& announced,
                 Answer answer)
    : answer_(std::move(answer)),
      replies_(peer, "millrace/" + uuid, "instance=" + text_of(id())),
      heartbeats_(peer, "millrace"),
      requests_(peer, "millrace/" + uuid + "/" + text_of(id()), announcement(uuid, announced)),
      thread_([this] { run(); }) {}

Service::~Service() {
  is_over_ = true;
  thread_.join();
}

void Service::run() {
  constexpr std::int64_t period = DDS_MSECS(300);
  std::int64_t due = 0;
  while (!is_over_) {
    if (now() >= due) {
      send_heartbeat();
      due = now() + period;
    }
    if (requests_.take([this](const millrace_Request& request) { answer(request); }) == 0) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
}

void Service::answer(const millrace_Request& request) {
  if (request.attempt == 0) {
    return;
  }
  millrace_Reply reply{};
  put(reply.machine, request.machine);
  reply.channel = request.channel;
  put(reply.instance, id());
  reply.epoch = request.epoch;
  reply.number = request.number;
  reply.attempt = request.attempt;
  reply.kind = millrace_reply_kind_final;
  reply.asked_text = {request.text._maximum, request.text._length, request.text._buffer, false};
  reply.asked_state = request.state;
  reply.received = reply.started = reply.answered = now();
  reply.extras = later_extras();
  std::vector<millrace_Reply> replies{reply};
  answer_(request, replies);
  for (const millrace_Reply& each : replies) {
    replies_.write(each);
  }
}

void Service::send_heartbeat() {
  millrace_InstanceLoad load{};
  put(load.instance, id());
  millrace_Heartbeat heartbeat{};
  put(heartbeat.process, id_of(2));
  heartbeat.at = now();
  heartbeat.loads = {1, 1, &load, false};
  heartbeat.extras = later_extras();
  heartbeats_.write(heartbeat);
}

}  // namespace millrace::tests::compat
