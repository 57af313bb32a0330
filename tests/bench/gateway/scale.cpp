#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "tests/bench/gateway/measurements.hpp"
#include "tests/bench/gateway/memory_gateway.hpp"
#include "tests/bench/gateway/peers.hpp"
#include "tests/bench/gateway/rows.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/cluster/driver/namespaces.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::bench {

// The plant of one row: services, gateways and observers as processes, on this host or on separate
// hosts, and its measurements.

struct PlantSize {
  std::uint32_t instances = 4;
  std::uint32_t processes = 4;
  /// 0: all instances have the same one.
  std::uint32_t uuids = 0;
  std::uint32_t gateways = 1;
  /// Of each gateway.
  std::uint32_t machines = 1;
  /// Of each machine; each has a call under way.
  std::uint32_t channels = 64;
  /// Processes of `millrace record`.
  std::uint32_t observers = 0;
  /// Hosts of the services, in addition to the one of the gateways and observers; 0: everything is
  /// on that one.
  std::uint32_t hosts = 0;
};

/// Sends these figures as they are known: `known` (seconds from the start of the last service until
/// each gateway knew all instances), `calls_per_second` of all gateways together, `gateway` and
/// `services` (us of processor time per call), `median` and `p99` (us, one call at a time for each
/// gateway), and for the time without calls `idle_gateways`, `idle_services`, `idle_observers` (%
/// of a core).
void measure_plant(const PlantSize& size, std::uint32_t idle_seconds);

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
    std::vector<std::vector<double>> figures;
    for (const auto& task : tasks) {
      const std::vector<std::string> groups = task->await(pattern, limit);
      std::vector<double>& numbers = figures.emplace_back();
      for (std::size_t i = 1; i < groups.size(); ++i) {
        numbers.push_back(std::stod(groups[i]));
      }
    }
    return figures;
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
    for (const auto& line : gateways_.await("^flooded (\\S+) (\\S+) (\\S+)", 2 * patience)) {
      rate += line[0];
      cost += line[1] / size_.gateways;
      calls += line[2];
    }
    tell_row({{"calls_per_second", rate},
              {"gateway", cost},
              {"services", 1e6 * (services_.processor_seconds() - before) / calls}});
  }

  void call_one_by_one() {
    gateways_.begin_phase();
    double median = 0;
    double p99 = 0;
    for (const auto& line : gateways_.await("^single (\\S+) (\\S+)", 2 * patience)) {
      median = std::max(median, line[0]);
      p99 = std::max(p99, line[1]);
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

namespace {

/// The limit for a row, in case a process hangs.
constexpr std::chrono::seconds limit_of_row{300};

struct Dimension {
  const char* name;
  /// What stays constant.
  const char* beside;
  std::vector<std::uint32_t> sizes;
  PlantSize (*plant)(std::uint32_t size);
};

const std::vector<Dimension>& all() {
  static const std::vector<Dimension> dimensions{
      {"instances",
       "processes of one UUID; 1 gateway, 64 channels",
       {1, 4, 16, 64, 100, 200},
       [](std::uint32_t n) { return PlantSize{.instances = n, .processes = n}; }},
      {"uuids",
       "an instance each, in one process; 1 gateway, 64 channels",
       {1, 10, 100, 1000},
       [](std::uint32_t n) { return PlantSize{.instances = n, .processes = 1, .uuids = n}; }},
      {"channels",
       "of one machine, each with a call; 1 gateway, 4 instances",
       {1, 16, 64, 256, 1000},
       [](std::uint32_t n) { return PlantSize{.channels = n}; }},
      {"machines",
       "of 4 channels, each with a call; 1 gateway, 4 instances",
       {1, 4, 16, 64, 250},
       [](std::uint32_t n) { return PlantSize{.machines = n, .channels = 4}; }},
      {"gateways",
       "of 16 channels, each with a call; they share 4 instances",
       {1, 2, 4, 8, 16},
       [](std::uint32_t n) { return PlantSize{.gateways = n, .channels = 16}; }},
      {"observers",
       "processes of millrace record; 1 gateway, 64 channels, 4 instances",
       {0, 1, 2, 4, 8},
       [](std::uint32_t n) { return PlantSize{.observers = n}; }},
      {"hosts",
       "that share 16 instances, and one of the gateway; 64 channels",
       {1, 2, 4, 8, 16},
       [](std::uint32_t n) { return PlantSize{.instances = 16, .processes = 16, .hosts = n}; }},
  };
  return dimensions;
}

const Dimension& find(const std::string& name) {
  const auto found = std::ranges::find_if(
      all(), [&](const Dimension& dimension) { return name == dimension.name; });
  if (found == all().end()) {
    throw std::runtime_error(fmt::format("there is no dimension '{}'", name));
  }
  return *found;
}

/// A figure that shows a bottleneck: relative to that of the smallest size, or by itself.
struct Sign {
  const char* figure;
  const char* name;
  /// This many times that of the smallest size; 0: `limit` counts.
  double worse = 0;
  double limit = 0;
};

constexpr std::array signs{
    Sign{.figure = "known", .name = "known within 3 s", .limit = 3},
    Sign{.figure = "calls_per_second", .name = "0.8 of the calls/s", .worse = 0.8},
    Sign{.figure = "median", .name = "1.5 of the p50", .worse = 1.5},
    Sign{.figure = "gateway", .name = "1.5 of the gateway's time for a call", .worse = 1.5},
    Sign{.figure = "services", .name = "1.5 of the services' time for a call", .worse = 1.5},
    Sign{.figure = "idle", .name = "20 % of a core without calls", .limit = 20},
};

bool gives_way(const Sign& sign, const Row& first, const Row& row) {
  if (!row.has(sign.figure)) {
    return true;
  }
  const double value = row.get(sign.figure);
  if (sign.worse == 0) {
    return value > sign.limit;
  }
  const double bound = sign.worse * first.get(sign.figure);
  return sign.worse < 1 ? value < bound : value > bound;
}

std::string header() {
  return fmt::format("{:>16}{:>9}{:>10}{:>7}{:>9}{:>15}{:>8}{:>7}{:>10}{:>11}\n", "", "known s",
                     "calls/s", "us gw", "services", "p50 / p99 us", "idle %", "= gw", "services",
                     "observers");
}

std::string line(const Dimension& of, std::uint32_t size, const Row& row) {
  return fmt::format(
      "{:>5} {:<10}{:>9}{:>10}{:>7}{:>9}{:>15}{:>8}{:>7}{:>10}{:>11}\n", size, of.name,
      row.text("known", 1), row.text("calls_per_second"), row.text("gateway"), row.text("services"),
      row.text("median") + " / " + row.text("p99"), row.text("idle", 1),
      row.text("idle_gateways", 1), row.text("idle_services", 1), row.text("idle_observers", 1));
}

/// The first size at which a sign exceeds that of the smallest size.
std::string first_bottleneck(const Dimension& of,
                             const std::vector<std::pair<std::uint32_t, Row>>& rows) {
  for (const auto& [size, row] : rows) {
    std::string what;
    for (const Sign& sign : signs) {
      if (gives_way(sign, rows.front().second, row)) {
        what += fmt::format("{}{}", what.empty() ? "" : "; ", sign.name);
      }
    }
    if (!what.empty()) {
      return fmt::format("  first bottleneck, with {} {}: {}\n", size, of.name, what);
    }
  }
  return "  no bottleneck\n";
}

bool measure(const Dimension& of, const ScaleOptions& options) {
  fmt::print("{}: {}\n{}", of.name, of.beside, header());
  bool complete = true;
  std::vector<std::pair<std::uint32_t, Row>> rows;
  for (const std::uint32_t size : options.sizes.empty() ? of.sizes : options.sizes) {
    const Row row = measure_row({"scale", "--of", of.name, "--sizes", std::to_string(size),
                                 "--idle", std::to_string(options.idle_seconds)},
                                limit_of_row);
    fmt::print("{}{}", line(of, size, row), row.trouble);
    std::fflush(stdout);
    complete &= row.has("idle");
    rows.emplace_back(size, row);
  }
  fmt::print("{}", first_bottleneck(of, rows));
  return complete;
}

}  // namespace

std::vector<std::string> dimensions() {
  std::vector<std::string> names;
  for (const Dimension& dimension : all()) {
    names.emplace_back(dimension.name);
  }
  return names;
}

bool measure_scale(const ScaleOptions& options) {
  fmt::print(
      "controllers in memory, inline handlers, every process on this machine. known: from the last "
      "start until\nall instances are; calls/s: a call under way on every channel; us: processor "
      "time for a call; p50: one\ncall at a time; idle: without calls, over {} s, % of one core\n",
      options.idle_seconds);
  bool complete = true;
  for (const std::string& name : options.of.empty() ? dimensions() : options.of) {
    complete &= measure(find(name), options);
  }
  return complete;
}

void measure_scale_row(const ScaleOptions& options) {
  measure_plant(find(options.of.front()).plant(options.sizes.front()), options.idle_seconds);
}

}  // namespace millrace::bench
