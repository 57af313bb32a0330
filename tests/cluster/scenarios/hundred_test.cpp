// A hundred instances on four hosts, with a week's events in half a minute: no call is lost, and
// none is answered twice.
#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "tests/cluster/scenarios/scenario.hpp"
#include "tests/cluster/scenarios/stopwatch.hpp"

namespace millrace::tests::cluster {
namespace {

using std::chrono_literals::operator""ms;

constexpr int hosts = 4;
constexpr std::uint32_t channels = 16;
constexpr std::uint32_t calls = 100;
/// The duration of each call, so that the load lasts during all events.
constexpr const char* work = "100";
/// Time for an event to show, with other work on both cores.
constexpr std::chrono::seconds allowed{60};

std::string host_of(int host) {
  return fmt::format("service-{}", host);
}

/// The instances that are ready, by the gateway's log.
class Presence {
 public:
  /// `log`: all of it so far.
  void read(const std::string& log) {
    for (auto end = log.find('\n', read_); end != std::string::npos; end = log.find('\n', read_)) {
      take(log.substr(read_, end - read_));
      read_ = end + 1;
    }
  }
  /// The number of names with this prefix.
  [[nodiscard]] std::size_t count(const std::string& prefix) const {
    std::size_t found = 0;
    for (const auto& [id, name] : names_) {
      found += name.starts_with(prefix) ? 1U : 0U;
    }
    return found;
  }

 private:
  /// "… instance ID of UUID is ready: NAME on HOST, pid 1", "… instance ID is gone: NAME on HOST,
  /// pid 1"
  void take(const std::string& line) {
    const auto at = line.find("instance ");
    if (at == std::string::npos) {
      return;
    }
    std::istringstream words(line.substr(at));
    std::string word;
    std::string id;
    words >> word >> id >> word;
    if (word == "of" && line.find(" is ready: ") != std::string::npos) {
      words >> word >> word >> word >> names_[id];
    } else if (word == "is" && line.find(" is gone: ") != std::string::npos) {
      names_.erase(id);
    }
  }

  std::size_t read_ = 0;
  std::map<std::string, std::string> names_;
};

class AHundredInstances : public Scenario {
 protected:
  /// Containers are too expensive for that many.
  static int per_host() { return GetParam() == Backend::namespaces ? 25 : 3; }

  void start() {
    // More participants than the usual 20 on a host.
    std::ofstream(sut().hosts().folder() / "crowded.fabric.textproto")
        << "interface: \"eth0\" unprotected: true\n";
    sut().gateway({"--log-level", "info"});
    for (int host = 1; host <= hosts; ++host) {
      sut().set_profile(host_of(host), "crowded.fabric.textproto");
      std::vector<std::string> names;
      for (int i = 1; i <= per_host(); ++i) {
        names.push_back(name_of(host, i));
      }
      sut().services(host_of(host), names, {"--work", work});
    }
    await_present("h", static_cast<std::size_t>(hosts * per_host()));
    sut().cnc({.channels = channels, .calls = calls});
    sut().await_finished(channels);
  }

  static std::string name_of(int host, int number) { return fmt::format("h{}-{}", host, number); }
  static std::string of_host(int host) { return fmt::format("h{}-", host); }

  /// Waits until this many instances with names of this prefix are ready.
  void await_present(const std::string& prefix, std::size_t count) {
    const Stopwatch watch;
    do {
      if (watch.time() > allowed) {
        throw std::runtime_error(fmt::format("the gateway has {} instances {}*, not {}",
                                             presence_.count(prefix), prefix, count));
      }
      std::this_thread::sleep_for(20ms);
      presence_.read(sut().task("gateway").log());
    } while (presence_.count(prefix) != count);
  }

  /// Expects further answers, as long as the programs make calls.
  void expect_calls_go_on(std::size_t number = 2 * channels) {
    const std::size_t left =
        channels * calls - std::min<std::size_t>(channels * calls, sut().finished());
    sut().await_finished(std::min(number, left));
  }

  void kill_one_after_the_other(int host, int number) {
    for (int i = 1; i <= number; ++i) {
      sut().task(name_of(host, i)).kill();
      expect_calls_go_on(4);
    }
  }

  void replace_one_by_one(int host) {
    for (int i = 1; i <= per_host(); ++i) {
      Task& old = sut().task(name_of(host, i));
      sut().service(host_of(host), fmt::format("new{}-{}", host, i), {"--work", work});
      old.terminate();
      EXPECT_EQ(old.wait(), 0) << old.log();
    }
  }

 private:
  Presence presence_;
};

TEST_P(AHundredInstances, LoseNoCallAndRunNoneTwiceUnderAnyFault) {
  const auto all = static_cast<std::size_t>(per_host());
  const int killed = per_host() / 3;
  const Stopwatch watch;
  start();
  report("a hundred instances ready, and the first calls of all channels answered", watch.time());

  kill_one_after_the_other(1, killed);
  await_present(of_host(1), all - static_cast<std::size_t>(killed));

  // Cut in both directions.
  sut().network().cut(host_of(2));
  await_present(of_host(2), 0);
  expect_calls_go_on();
  sut().network().heal();
  await_present(of_host(2), all);

  // It hears the others and is not heard: it takes no part, and does not notice.
  sut().network().cut_one_way(host_of(3), "gateway");
  await_present(of_host(3), 0);
  expect_calls_go_on();
  sut().network().heal();
  await_present(of_host(3), all);

  // It is heard and hears nothing: its heartbeats arrive, but calls do not reach it.
  sut().network().cut_one_way("gateway", host_of(3));
  expect_calls_go_on();
  expect_calls_go_on();
  sut().network().heal();
  expect_calls_go_on();

  replace_one_by_one(4);
  await_present(of_host(4), 0);
  await_present("new4-", all);
  report("all events", watch.time());
  fmt::print("measured: {} of {} calls finished by then\n", sut().finished(), channels * calls);
  sut().expect_all_answered(std::chrono::minutes(2));
}

INSTANTIATE_TEST_SUITE_P(Cluster, AHundredInstances, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
