#include "tools/doctor/examine.hpp"

#include <algorithm>
#include <exception>
#include <optional>

#include <boost/asio/io_context.hpp>

#include "base/posix/host.hpp"
#include "fabric/dds/authenticator.hpp"
#include "fabric/endpoints/discovery.hpp"
#include "fabric/observer/observer.hpp"
#include "tools/bus/alarm_reader.hpp"
#include "tools/bus/operator.hpp"
#include "tools/doctor/endpoints.hpp"

namespace millrace::tools::doctor {

namespace {

using Clock = std::chrono::steady_clock;

/// How often arrived samples are taken.
constexpr auto turn = std::chrono::milliseconds(50);
/// Enough that one of them meets an idle host.
constexpr int exchanges = 5;
constexpr auto patience_for_the_time = std::chrono::milliseconds(1000);

struct Listener : fabric::observer::ObserverListener, bus::AlarmListener {
  void on_entry(recording::Entry entry) override { live.add(entry); }
  void on_ignored(const std::string& reason) override { doubts.push_back(reason); }
  void on_alarm(const fabric::Alarm& alarm) override { live.add(alarm); }
  void on_alarm_gone(const fabric::AlarmKey& key) override { live.take_back(key); }
  bus::FabricModel live;
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

std::vector<ClockSource> clock_sources_in(const bus::FabricModel& live) {
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
                                      const bus::FabricModel& live) {
  const std::vector<ClockSource> sources = clock_sources_in(live);
  std::vector<ClockComparison> comparisons(sources.size());
  for (int i = 0; i < exchanges && !sources.empty(); ++i) {
    std::vector<fabric::Command> commands;
    for (const ClockSource& source : sources) {
      commands.push_back(source.question);
      commands.back().id = fabric::InstanceId::random();
      commands.back().at = std::chrono::system_clock::now();
    }
    const auto heard = bus::issue(participant, commands, patience_for_the_time);
    for (std::size_t w = 0; w < sources.size(); ++w) {
      if (const auto word = heard.find(commands[w].id); word != heard.end()) {
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

class Visit {
 public:
  Visit(const Examination& examination, Findings& found)
      : participant_(examination.join),
        directory_(participant_),
        discovery_(participant_, nullptr),
        readers_(participant_),
        observer_(participant_, io_.get_executor(), listener_, fabric::observer::Interest::states),
        alarms_(participant_, io_.get_executor(), listener_),
        found_(found) {}

  void listen(std::chrono::milliseconds time, AnnouncementReceiver* receiver) {
    const auto end = Clock::now() + time;
    const auto work = boost::asio::make_work_guard(io_);
    while (Clock::now() < end) {
      const auto next = std::min(Clock::now() + turn, end);
      while (io_.run_one_until(next) != 0) {
      }
      directory_.drain();
      const auto news = discovery_.drain(registry_, Clock::now());
      for (const auto& one : news.ignored) {
        found_.ignored.push_back(one.reason);
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
    found_.programs = programs_in(directory_, fabric, participant_.authenticator());
    found_.misfits = misfits_in(directory_, readers_.matched(), fabric);
    found_.clocks = compare_clocks(participant_, found_.live);
  }

 private:
  boost::asio::io_context io_{1};
  Listener listener_;
  fabric::dds::Participant participant_;
  Directory directory_;
  fabric::registry::InstanceRegistry registry_;
  fabric::endpoints::Discovery discovery_;
  TopicReaders readers_;
  fabric::observer::Observer observer_;
  bus::AlarmReader alarms_;
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
    if (receiver) {
      found.deaf = receiver->trouble();
      for (const auto& [prefix, heard] : receiver->heard()) {
        found.heard.push_back(heard);
      }
    }
    found.peers = probe_peers(examination.joining.peers, examination.joining.domain);
  } catch (const std::exception& error) {
    found.obstacle = error.what();
  }
  return found;
}

}  // namespace millrace::tools::doctor
