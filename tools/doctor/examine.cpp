#include "tools/doctor/examine.hpp"

#include <algorithm>
#include <exception>
#include <optional>
#include <set>
#include <type_traits>
#include <utility>

#include <boost/asio/io_context.hpp>

#include "base/messages/catalogue.hpp"
#include "base/posix/system.hpp"
#include "fabric/dds/authenticator.hpp"
#include "fabric/endpoints/discovery.hpp"
#include "fabric/observer/observer.hpp"
#include "fabric/participant_identity.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/topics.hpp"
#include "tools/bus/operator.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/doctor/checks/checks.hpp"
#include "tools/doctor/clock.hpp"
#include "tools/doctor/directory.hpp"

namespace millrace::tools::doctor {

namespace {

using Clock = std::chrono::steady_clock;

/// Enough that one of them meets an idle host.
constexpr int exchanges = 5;
constexpr auto patience_for_the_time = std::chrono::milliseconds(1000);

struct Listener : fabric::observer::ObserverListener {
  void on_entry(fabric::observer::Entry entry) override { live.add(entry); }
  void on_ignored(const std::string& reason) override { doubts.push_back(reason); }
  fabric::plant::Plant live;
  std::vector<std::string> doubts;
};

/// The name of the interface that `wanted`, a name or an address, means; `wanted` if none.
std::string interface_name(const std::vector<Interface>& interfaces, const std::string& wanted) {
  const auto found = std::ranges::find(interfaces, wanted, &Interface::address);
  return found == interfaces.end() || wanted.empty() ? wanted : found->name;
}

/// The process of another host whose clock is compared.
struct ClockSource {
  std::string host;
  std::string program;
  fabric::Command question;
};

fabric::Command question() {
  return {.kind = fabric::CommandKind::ping, .issuer = bus::issuer_here()};
}

std::vector<ClockSource> clock_sources_in(const fabric::plant::Plant& live) {
  std::vector<ClockSource> sources;
  const std::string own = base::posix::host_name();
  const auto is_new = [&](const std::string& host) {
    return !host.empty() && host != own &&
           std::ranges::none_of(sources,
                                [&](const ClockSource& source) { return source.host == host; });
  };
  for (const auto& [id, instance] : live.instances()) {
    if (is_new(instance.identity.host)) {
      fabric::Command ask = question();
      ask.instance = id;
      sources.push_back({instance.identity.host, instance.identity.name, std::move(ask)});
    }
  }
  for (const auto& [key, channel] : live.channels()) {
    for (const auto& [gateway, status] : live.machines()) {
      if (status.machine == key.machine && status.connected && is_new(status.host)) {
        fabric::Command ask = question();
        ask.key = key;
        sources.push_back({status.host, "the gateway of " + key.machine, std::move(ask)});
      }
    }
  }
  return sources;
}

/// Exchanges stamps with all of them, several times.
std::vector<HostClock> compare_clocks(fabric::dds::Participant& participant,
                                      const fabric::plant::Plant& live, const std::string& flags) {
  const std::vector<ClockSource> sources = clock_sources_in(live);
  std::vector<ClockComparison> comparisons(sources.size());
  for (int i = 0; i < exchanges && !sources.empty(); ++i) {
    std::vector<fabric::Command> commands;
    for (const ClockSource& source : sources) {
      commands.push_back(source.question);
      commands.back().id = fabric::InstanceId::random();
      commands.back().at = std::chrono::system_clock::now();
    }
    const auto outcomes = bus::issue(participant, commands, patience_for_the_time, flags);
    for (std::size_t w = 0; w < sources.size(); ++w) {
      if (const auto word = outcomes.find(commands[w].id); word != outcomes.end()) {
        const bus::CommandResult& answer = word->second;
        comparisons[w].add({answer.at - answer.after, answer.outcome.at, answer.at});
      }
    }
  }
  std::vector<HostClock> clocks;
  for (std::size_t w = 0; w < sources.size(); ++w) {
    if (const auto& difference = comparisons[w].result()) {
      clocks.push_back({sources[w].host, sources[w].program, *difference});
    }
  }
  return clocks;
}

namespace messages = base::messages;
using fabric::wire::Keep;
using fabric::wire::Topic;
using messages::Message;

/// Readers of topics of a fabric, only to see which writers DDS matches with them.
template <typename... Values>
class ReadersOf : fabric::wire::Reader<Values>... {
 public:
  /// Throws std::runtime_error with Cyclone's reason.
  explicit ReadersOf(const fabric::dds::Participant& participant)
      : fabric::wire::Reader<Values>(participant, partition<Values>(participant.options().fabric),
                                     Keep::last)... {}

  /// The writers that are matched with one of the readers.
  [[nodiscard]] std::set<Handle> matched() const {
    std::set<Handle> all;
    const auto add = [&](const auto& handles) { all.insert(handles.begin(), handles.end()); };
    (add(fabric::wire::Reader<Values>::matched()), ...);
    return all;
  }

  /// Null if none of the topics has this name.
  static const Topic* topic_named(const std::string& name) {
    for (const Topic* topic : {&fabric::wire::Codec<Values>::topic()...}) {
      if (topic->name == name) {
        return topic;
      }
    }
    return nullptr;
  }

 private:
  template <typename Value>
  static std::string partition(const std::string& fabric) {
    constexpr bool of_service =
        std::is_same_v<Value, fabric::Request> || std::is_same_v<Value, fabric::Reply>;
    return of_service ? fabric::wire::all_services(fabric) : fabric;
  }
};

using TopicReaders = ReadersOf<fabric::Request, fabric::Reply, fabric::Heartbeat,
                               fabric::ChannelStatus, fabric::MachineStatus, fabric::Event,
                               fabric::Command, fabric::Outcome, fabric::Alarm>;

bool is_in(const SeenEndpoint& endpoint, const std::string& fabric) {
  return std::ranges::any_of(endpoint.partitions, [&](const std::string& partition) {
    return fabric::wire::fabric_of(partition) == fabric;
  });
}

Message text_of(const Directory& directory, Handle participant) {
  const auto found = directory.participants().find(participant);
  return checks::program_text(found == directory.participants().end() ? Announcement{}
                                                                      : found->second.who);
}

bool is_own(const Directory& directory, const SeenEndpoint& endpoint) {
  const auto found = directory.participants().find(endpoint.participant);
  return found != directory.participants().end() && found->second.self;
}

/// Compared with the endpoint of a millrace process at the other end.
std::vector<Message> reasons_of(const SeenEndpoint& endpoint, const Topic& topic, bool matched) {
  const EndpointQos own = endpoint.writer
                              ? qos_of(*fabric::wire::reader_qos(topic, Keep::last), false)
                              : qos_of(*fabric::wire::writer_qos(topic), true);
  std::vector<Message> reasons =
      endpoint.writer ? misfits(endpoint.qos, own) : misfits(own, endpoint.qos);
  if (endpoint.type != topic.type->m_typename) {
    reasons.push_back(messages::type_differs(endpoint.type, topic.type->m_typename));
  }
  if (reasons.empty() && endpoint.writer && !matched) {
    reasons.emplace_back(messages::members_differ());
  }
  return reasons;
}

/// The mistakes in others' endpoints of this fabric: QoS or type match no millrace process, or DDS
/// does not match a writer although both fit.
std::vector<Misfit> misfits_in(const Directory& directory, const std::set<Handle>& matched,
                               const std::string& fabric) {
  std::vector<Misfit> all;
  for (const auto& [handle, endpoint] : directory.endpoints()) {
    const Topic* topic = TopicReaders::topic_named(endpoint.topic);
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

/// With trust, an announced UUID counts only for a participant that may answer for it: DDS has
/// matched a writer of its replies.
std::set<std::pair<Handle, std::string>> proved_services(const Directory& directory,
                                                         const std::set<Handle>& matched) {
  std::set<std::pair<Handle, std::string>> all;
  for (const auto& [handle, endpoint] : directory.endpoints()) {
    if (endpoint.writer && endpoint.topic == fabric::wire::reply_topic.name &&
        matched.contains(handle)) {
      for (const std::string& partition : endpoint.partitions) {
        all.emplace(endpoint.participant, partition);
      }
    }
  }
  return all;
}

/// Of a process that announces none: from the name of one of its topics.
void add_wire_version(std::string_view topic, fabric::ProcessVersion& process) {
  if (const auto version = fabric::wire_version_of(topic)) {
    process.lowest_wire =
        process.lowest_wire == 0 ? *version : std::min(process.lowest_wire, *version);
    process.highest_wire = std::max(process.highest_wire, *version);
  }
}

/// The other processes on the domain. `authenticator` is null without trust.
std::vector<Program> programs_in(const Directory& directory, const std::string& fabric,
                                 const std::set<Handle>& matched,
                                 const fabric::dds::Authenticator* authenticator) {
  const auto proved = proved_services(directory, matched);
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
                             .version = participant.version.value_or(fabric::ProcessVersion{}),
                             .announces_identity = authenticator == nullptr || participant.self ||
                                                   authenticator->look_up(handle).status.identity});
  }
  for (const auto& [handle, endpoint] : directory.endpoints()) {
    const auto program = programs.find(endpoint.participant);
    if (program == programs.end()) {
      continue;
    }
    if (!directory.participants().at(endpoint.participant).version && is_in(endpoint, fabric)) {
      add_wire_version(endpoint.topic, program->second.version);
    }
    for (const std::string& partition : endpoint.partitions) {
      program->second.fabrics.insert(fabric::wire::fabric_of(partition));
      const auto request_partition = fabric::wire::parse_request_partition(fabric, partition);
      if (request_partition && !endpoint.writer &&
          endpoint.topic == fabric::wire::request_topic.name && !endpoint.user_data.empty() &&
          (authenticator == nullptr ||
           proved.contains({endpoint.participant,
                            fabric::wire::service_partition(fabric, request_partition->uuid)}))) {
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

class Visit {
 public:
  Visit(const Examination& examination, Findings& found)
      : participant_(examination.join),
        directory_(participant_),
        discovery_(participant_, fabric::endpoints::Discovery::Of::tools, nullptr),
        readers_(participant_),
        observer_(participant_, io_.get_executor(), listener_, fabric::observer::Interest::states),
        found_(found) {}

  /// Longer on a busy host, and while names, processes and endpoints are missing.
  void listen(std::chrono::milliseconds time, AnnouncementReceiver* receiver) {
    bus::ListeningTime listening({.at_least = time, .at_most = 3 * time}, Clock::now());
    std::size_t known = 0;
    const auto work = boost::asio::make_work_guard(io_);
    const auto end = [&] { return listening.end(is_a_name_missing()); };
    while (Clock::now() < end()) {
      const auto next = std::min(Clock::now() + bus::ListeningTime::look_again, end());
      while (io_.run_one_until(next) != 0) {
      }
      listening.on_timer(next, Clock::now());
      directory_.drain();
      const std::size_t found = directory_.participants().size() + directory_.endpoints().size();
      if (std::exchange(known, found) < found) {
        listening.on_news(Clock::now());
      }
      const auto news = discovery_.drain(registry_, Clock::now());
      for (const auto& ignored : news.ignored) {
        found_.ignored.push_back(ignored.reason);
      }
      if (receiver != nullptr) {
        receiver->take();
      }
    }
  }

  void finish() {
    const std::string& fabric = participant_.options().fabric;
    observer_.drain();
    found_.live = listener_.live;
    found_.doubts = listener_.doubts;
    if (participant_.authenticator() != nullptr) {
      for (const fabric::IdentityStatus& status : participant_.authenticator()->all()) {
        if (!status.revoked) {
          found_.identities.push_back(*status.identity);
        }
      }
    }
    const std::set<Handle> matched = readers_.matched();
    found_.programs = programs_in(directory_, fabric, matched, participant_.authenticator());
    found_.misfits = misfits_in(directory_, matched, fabric);
    found_.clocks = compare_clocks(participant_, found_.live, found_.joining.flags);
  }

 private:
  /// With trust a process announces its name after the proof of its certificate.
  [[nodiscard]] bool is_a_name_missing() const {
    if (participant_.authenticator() == nullptr) {
      return false;
    }
    std::set<Handle> named;
    for (const auto& [handle, endpoint] : directory_.endpoints()) {
      if (endpoint.topic == fabric::identity_topic_name) {
        named.insert(endpoint.participant);
      }
    }
    return std::ranges::any_of(directory_.participants(), [&](const auto& seen) {
      return !seen.second.self && !named.contains(seen.first);
    });
  }

  boost::asio::io_context io_{1};
  Listener listener_;
  fabric::dds::Participant participant_;
  Directory directory_;
  fabric::registry::InstanceRegistry registry_;
  fabric::endpoints::Discovery discovery_;
  TopicReaders readers_;
  fabric::observer::Observer observer_;
  Findings& found_;
};

}  // namespace

Findings examine(const Examination& examination) {
  Findings found{
      .joining = examination.joining, .interfaces = interfaces_here(), .lost = examination.lost};
  const std::string interface = interface_name(found.interfaces, examination.joining.interface);
  // Read before this process itself is among them.
  found.domains_here = domains_in(read_text("/proc/net/udp"));
  found.listening_interfaces = listening_interfaces_in(read_text("/proc/net/igmp"));
  try {
    Visit visit(examination, found);
    std::optional<AnnouncementReceiver> receiver;
    if (examination.joining.multicast) {
      receiver.emplace(interface);
    }
    visit.listen(examination.listen, receiver ? &*receiver : nullptr);
    visit.finish();
    found.joining.now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
    if (receiver) {
      found.deaf = receiver->trouble();
      for (const auto& [prefix, announcement] : receiver->announcements()) {
        found.announcements.push_back(announcement);
      }
    }
    found.peers = probe_peers(examination.joining.peers, examination.joining.domain);
  } catch (const std::exception& error) {
    found.obstacle = error.what();
  }
  return found;
}

}  // namespace millrace::tools::doctor
