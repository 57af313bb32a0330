#include <atomic>
#include <csignal>
#include <limits>
#include <map>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/bench/gateway/measurements.hpp"
#include "tests/bench/gateway/memory_gateway.hpp"
#include "tests/bench/gateway/peers.hpp"
#include "tests/support/domain.hpp"

namespace millrace::bench {

namespace {

/// Two busy processes for each core.
class Load {
 public:
  Load() {
    const unsigned count = 2 * std::thread::hardware_concurrency();
    for (unsigned i = 0; i < count; ++i) {
      const pid_t child = ::fork();
      if (child == 0) {
        for (std::atomic<std::uint64_t> spin = 0;;) {
          ++spin;
        }
      }
      children_.push_back(child);
    }
  }
  ~Load() {
    for (const pid_t child : children_) {
      ::kill(child, SIGKILL);
      ::waitpid(child, nullptr, 0);
    }
  }
  Load(const Load&) = delete;
  Load& operator=(const Load&) = delete;

 private:
  std::vector<pid_t> children_;
};

}  // namespace

bool measure_takeover() {
  constexpr int rounds = 20;
  constexpr double goal_seconds = 0.6;
  const tests::Domain domain;
  MemoryGateway gateway(domain.number(), 1, 1);
  std::map<std::uint32_t, tests::Process> services;
  const auto add = [&] {
    tests::Process process = start_service(domain.number(), 1, "stuck");
    const auto pid = static_cast<std::uint32_t>(process.pid());
    services.emplace(pid, std::move(process));
  };
  add();
  add();
  Series times;
  for (int round = 0; round < rounds; ++round) {
    gateway.await_instances(2);
    gateway.begin(1);
    const auto given = gateway.given_at();
    gateway.run_until([&] { return gateway.given_at() != given; });
    const auto attempt = gateway.given_attempt();
    const std::uint32_t pid = gateway.pid_of(gateway.given_to());
    const auto killed = Clock::now();
    services.at(pid).signal(SIGKILL);
    gateway.run_until([&] { return gateway.given_attempt() > attempt; });
    times.add(gateway.given_at() - killed);
    services.erase(pid);
    gateway.withdraw();
    add();
  }
  const double worst = times.quantile(1) / 1e6;
  fmt::print(
      "kill -9 of an instance -> the call is dispatched to another, {} rounds: median {:.2f} s, "
      "worst {:.2f} s   {}\n",
      rounds, times.median() / 1e6, worst, verdict(worst, goal_seconds, true));
  return worst <= goal_seconds;
}

bool measure_alarms(std::chrono::seconds time) {
  // Before there are threads, since it forks.
  const Load load;
  const tests::Domain domain;
  std::vector<tests::Process> services;
  for (int i = 0; i < 4; ++i) {
    services.push_back(start_service(domain.number(), 1));
  }
  MemoryGateway gateway(domain.number(), 10, 2);
  gateway.await_instances(services.size());
  gateway.begin(std::numeric_limits<std::size_t>::max());
  const auto end = Clock::now() + time;
  gateway.run_until([&] { return Clock::now() >= end; });
  fmt::print("{} s with both cores loaded, 4 instances: {} lost by mistake   {}\n", time.count(),
             gateway.lost(), verdict(static_cast<double>(gateway.lost()), 0, true));
  return gateway.lost() == 0;
}

}  // namespace millrace::bench
