#include "tests/bench/gateway/scale_plant.hpp"

#include <algorithm>
#include <atomic>
#include <csignal>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "tests/bench/gateway/memory_gateway.hpp"
#include "tests/bench/gateway/peers.hpp"
#include "tests/bench/gateway/rows.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/cluster/driver/namespaces.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::bench {

namespace {

using std::chrono::seconds;
using tests::cluster::Task;

/// For discovery, and for the calls of a phase.
constexpr seconds patience{60};
constexpr double seconds_of_flood = 3;
constexpr std::size_t single_calls = 400;
constexpr std::uint32_t most_concurrency = 256;

// ---- The gateway, a process that goes to its next phase on demand

std::atomic<int> wanted_phase = 0;

void on_signal(int /*signal*/) {
  ++wanted_phase;
}

/// The next phase may begin.
void await_phase(MemoryGateway& gateway, int phase) {
  while (!gateway.run_until([&] { return wanted_phase >= phase; }, std::chrono::milliseconds(50))) {
  }
}

void say(const std::string& text) {
  fmt::print("{}\n", text);
  std::fflush(stdout);
}

/// Calls on all channels at once, for some seconds.
void flood(MemoryGateway& gateway, std::size_t in_flight) {
  const std::size_t warm_up = std::max<std::size_t>(500, 2 * in_flight);
  const auto warm = gateway.run_within(warm_up, patience);
  if (!warm) {
    throw std::runtime_error("the calls to warm up were not answered");
  }
  const auto calls = std::clamp<std::size_t>(
      static_cast<std::size_t>(seconds_of_flood * warm->calls_per_second), warm_up, 400'000);
  const auto result = gateway.run_within(calls, patience);
  if (!result) {
    throw std::runtime_error("the calls were not answered");
  }
  say(fmt::format("flooded {} {} {}", result->calls_per_second, result->microseconds_per_call,
                  warm_up + calls));
}

void call_one_by_one(MemoryGateway& gateway) {
  gateway.call_on_one_channel();
  gateway.run_within(single_calls / 2, patience);
  auto result = gateway.run_within(single_calls, patience);
  if (!result) {
    throw std::runtime_error("single calls were not answered");
  }
  say(fmt::format("single {} {}", result->replied.median(), result->replied.p99()));
}

// ---- The row

struct Processes {
  std::vector<std::unique_ptr<Task>> tasks;

  [[nodiscard]] double processor_seconds() const {
    double all = 0;
    for (const auto& task : tasks) {
      all += bench::processor_seconds(task->pid());
    }
    return all;
  }
  void begin_phase() const {
    for (const auto& task : tasks) {
      ::kill(task->pid(), SIGUSR1);
    }
  }
  /// The figures that each of them prints for the phase, by the groups of the pattern.
  std::vector<std::vector<double>> await(const std::string& pattern, seconds limit) const {
    std::vector<std::vector<double>> said;
    for (const auto& task : tasks) {
      const std::vector<std::string> groups = task->await(pattern, limit);
      std::vector<double>& numbers = said.emplace_back();
      for (std::size_t i = 1; i < groups.size(); ++i) {
        numbers.push_back(std::stod(groups[i]));
      }
    }
    return said;
  }
};

/// Where the processes run.
class Site {
 public:
  explicit Site(std::uint32_t hosts) : hosts_(hosts) {
    if (hosts == 0) {
      return;
    }
    std::vector<std::string> names{"gateway"};
    for (std::uint32_t i = 1; i <= hosts; ++i) {
      names.push_back(name_of(i));
    }
    constexpr std::uint64_t seed = 1;
    site_.emplace(names, seed);
  }

  [[nodiscard]] std::string interface() const { return site_ ? "eth0" : ""; }

  /// Distributed over the hosts in turn.
  std::unique_ptr<Task> start_service(const PeerOptions& options, std::uint32_t number) {
    return start(site_ ? name_of(number % hosts_ + 1) : "", options);
  }
  std::unique_ptr<Task> start_gateway(const PeerOptions& options) {
    return start("gateway", options);
  }
  std::unique_ptr<Task> start_observer(std::vector<std::string> arguments) {
    if (site_) {
      return site_->up("gateway", "millrace", arguments);
    }
    arguments.insert(arguments.begin(), tests::binary("millrace"));
    return std::make_unique<Task>(std::move(arguments));
  }

 private:
  static std::string name_of(std::uint32_t host) { return fmt::format("host-{}", host); }

  std::unique_ptr<Task> start(const std::string& host, const PeerOptions& options) {
    std::vector<std::string> arguments = peer_arguments(options);
    if (site_) {
      return site_->up(host, "gateway_bench", arguments);
    }
    arguments.insert(arguments.begin(), "/proc/self/exe");
    return std::make_unique<Task>(std::move(arguments));
  }

  std::uint32_t hosts_;
  std::optional<tests::cluster::Namespaces> site_;
};

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

class GrownPlant {
 public:
  explicit GrownPlant(const PlantSize& size) : size_(size), site_(size.hosts) {}

  void start() {
    for (std::uint32_t i = 0; i < size_.gateways; ++i) {
      gateways_.tasks.push_back(site_.start_gateway({.kind = "gateway",
                                                     .domain = domain_.number(),
                                                     .number = i,
                                                     .count = size_.instances,
                                                     .channels = size_.channels,
                                                     .machines = size_.machines,
                                                     .uuids = size_.uuids,
                                                     .interface = site_.interface()}));
    }
    for (std::uint32_t i = 0; i < size_.observers; ++i) {
      observers_.tasks.push_back(
          site_.start_observer({"record", "--domain", std::to_string(domain_.number()), "-o",
                                (folder_.path() / fmt::format("{}.mcap", i)).string()}));
    }
    gateways_.await("^up", patience);
    observers_.await("^ready", patience);
    start_services();
    gateways_.await("^known", patience);
    tell_row({{"known", since(started_)}});
  }

  void flood() {
    // Endpoints are known, but discovery is still busy, which is not part of a call.
    std::this_thread::sleep_for(seconds(3));
    const double before = services_.processor_seconds();
    gateways_.begin_phase();
    double rate = 0;
    double cost = 0;
    double calls = 0;
    for (const auto& one : gateways_.await("^flooded (\\S+) (\\S+) (\\S+)", 2 * patience)) {
      rate += one[0];
      cost += one[1] / size_.gateways;
      calls += one[2];
    }
    tell_row({{"calls_per_second", rate},
              {"gateway", cost},
              {"services", 1e6 * (services_.processor_seconds() - before) / calls}});
  }

  void call_one_by_one() {
    gateways_.begin_phase();
    double median = 0;
    double p99 = 0;
    for (const auto& one : gateways_.await("^single (\\S+) (\\S+)", 2 * patience)) {
      median = std::max(median, one[0]);
      p99 = std::max(p99, one[1]);
    }
    tell_row({{"median", median}, {"p99", p99}});
  }

  void be_idle(seconds time) {
    // Cleaning up after the calls takes a second or two.
    std::this_thread::sleep_for(seconds(3));
    const auto start = Clock::now();
    const std::vector<std::pair<const char*, const Processes*>> all{
        {"idle_gateways", &gateways_},
        {"idle_services", &services_},
        {"idle_observers", &observers_}};
    std::vector<double> before;
    for (const auto& [name, processes] : all) {
      before.push_back(processes->processor_seconds());
    }
    std::this_thread::sleep_for(time);
    const double took = since(start);
    double sum = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double share = 100 * (all[i].second->processor_seconds() - before[i]) / took;
      tell_row({{all[i].first, share}});
      sum += share;
    }
    tell_row({{"idle", sum}});
  }

 private:
  void start_services() {
    const std::uint32_t in_flight = size_.gateways * size_.machines * size_.channels;
    const std::uint32_t concurrency =
        std::min((in_flight + size_.instances - 1) / size_.instances, most_concurrency);
    for (std::uint32_t i = 0; i < size_.processes; ++i) {
      services_.tasks.push_back(
          site_.start_service({.kind = size_.uuids > 0 ? "uuids" : "inline",
                               .domain = domain_.number(),
                               .count = size_.instances / size_.processes +
                                        (i < size_.instances % size_.processes ? 1U : 0U),
                               .concurrency = concurrency,
                               .interface = site_.interface()},
                              i));
    }
    started_ = Clock::now();
  }

  const PlantSize size_;
  const tests::Domain domain_;
  const tests::TemporaryFolder folder_;
  Site site_;
  Processes gateways_;
  Processes observers_;
  Processes services_;
  Clock::time_point started_;
};

}  // namespace

void serve_gateway(const PeerOptions& options) {
  std::signal(SIGUSR1, on_signal);
  std::vector<std::string> machines;
  for (std::uint32_t i = 0; i < options.machines; ++i) {
    machines.push_back(fmt::format("cnc-{}-{}", options.number, i));
  }
  MemoryGateway gateway(MemoryPlant{.domain = options.domain,
                                    .channels = options.channels,
                                    .active = options.channels,
                                    .machines = std::move(machines),
                                    .uuids = options.uuids,
                                    .interface = options.interface});
  say("up");
  if (!gateway.run_until([&] { return gateway.instances() >= options.count; }, patience)) {
    throw std::runtime_error(fmt::format("{} of {} instances known after {} s", gateway.instances(),
                                         options.count, patience.count()));
  }
  say("known");
  await_phase(gateway, 1);
  flood(gateway, std::size_t{options.machines} * options.channels);
  await_phase(gateway, 2);
  call_one_by_one(gateway);
  // Until it is killed.
  await_phase(gateway, std::numeric_limits<int>::max());
}

void measure_plant(const PlantSize& size, std::uint32_t idle_seconds) {
  GrownPlant plant(size);
  plant.start();
  plant.flood();
  plant.call_one_by_one();
  plant.be_idle(seconds(idle_seconds));
}

}  // namespace millrace::bench
