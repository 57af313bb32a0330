// What the gateway costs, beside its peers in the same run.
//
//   gateway_bench call         accept -> reply, against raw Cyclone, gRPC and LCM
//   gateway_bench throughput   256 channels, 4 instances, against raw Cyclone
//   gateway_bench cost         processor time of a call with 1,000 channels, against one
//   gateway_bench program      what an NC program sees, against a service that polls by itself
//   gateway_bench load         ADS requests per second, against services that poll by themselves
//   gateway_bench idle         memory with 1,000 channels, processor time of 10 idle ones
//   gateway_bench takeover     kill -9 of an instance until its call runs on another
//   gateway_bench alarm [SECONDS]   instances lost by mistake while both cores are loaded
//   gateway_bench scaling      1, 4, 16 and 64 instances of one UUID, against raw Cyclone
//   gateway_bench presence     10 to 200 idle service processes, against raw Cyclone
//   gateway_bench presence --uuids 1000   one process with so many UUIDs
//   gateway_bench scale        instances, UUIDs, channels, machines, gateways, observers and hosts
//                              each grown alone; hosts need root (network namespaces)
//
// Exit code 1 if a goal is missed. Results of a run: docs/benchmarks.md.
#include <atomic>
#include <csignal>
#include <functional>
#include <map>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <sys/wait.h>

#include "tests/bench/gateway/controllers.hpp"
#include "tests/bench/gateway/memory_gateway.hpp"
#include "tests/bench/gateway/others.hpp"
#include "tests/bench/gateway/peers.hpp"
#include "tests/bench/gateway/presence.hpp"
#include "tests/bench/gateway/raw_dds.hpp"
#include "tests/bench/gateway/rows.hpp"
#include "tests/bench/gateway/scale.hpp"
#include "tests/bench/gateway/scaling.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/support/domain.hpp"

namespace millrace::bench {

#ifndef MILLRACE_BENCH_GRPC
std::optional<Series> measure_grpc(std::size_t, std::size_t) {
  return std::nullopt;
}
void serve_grpc(const PeerOptions&) {}
#endif
#ifndef MILLRACE_BENCH_LCM
std::optional<Series> measure_lcm(std::size_t, std::size_t) {
  return std::nullopt;
}
void serve_lcm(const PeerOptions&) {}
#endif

namespace {

constexpr std::size_t warm_up = 1000;
/// Bytes of a request on the wire, about.
constexpr std::size_t message_size = 200;

tests::Process service(std::uint32_t domain, std::uint32_t concurrency,
                       const std::string& kind = "service") {
  PeerOptions options;
  options.kind = kind;
  options.domain = domain;
  options.concurrency = concurrency;
  return start_peer(options);
}

void print(const char* what, Series series, double floor) {
  fmt::print("  {:<34}{:>10.1f}{:>10.1f}{:>10.2f}\n", what, series.median(), series.p99(),
             series.median() / floor);
}

/// What calls cost with one service that answers them in one way or another; `also` goes on.
void measure_ours(const std::string& kind, std::size_t calls, Series& replied,
                  const std::function<void(MemoryGateway&)>& also = {}) {
  const tests::Domain domain;
  const auto instance = service(domain.number(), 1, kind);
  MemoryGateway gateway(domain.number(), 1, 1);
  gateway.await_instances(1);
  gateway.run(warm_up);
  replied.add(gateway.run(calls).replied);
  if (also) {
    also(gateway);
  }
}

bool measure_call() {
  constexpr std::size_t rounds = 5;
  constexpr std::size_t calls = 4000;
  Series ours;
  Series threaded;
  Series dozing;
  Series raw;
  Series grpc;
  Series lcm;
  for (std::size_t round = 0; round < rounds; ++round) {
    {
      const tests::Domain domain;
      measure_raw(domain.number(), warm_up, 1, 1);
      raw.add(measure_raw(domain.number(), calls, 1, 1).round_trips);
    }
    measure_ours("prompt", calls, ours, [&](MemoryGateway& gateway) {
      gateway.doze();
      dozing.add(gateway.run(calls).replied);
    });
    measure_ours("service", calls, threaded);
    if (const auto series = measure_grpc(calls, message_size)) {
      grpc.add(*series);
    }
    if (const auto series = measure_lcm(calls, message_size)) {
      lcm.add(*series);
    }
  }
  const double floor = raw.median();
  fmt::print("one call at a time, {} x {} calls, microseconds\n", rounds, calls);
  fmt::print("  {:<34}{:>10}{:>10}{:>10}\n", "", "median", "p99", "ratio");
  print("raw Cyclone ping-pong (listener)", raw, floor);
  print("gateway: accepted -> reply is here", ours, floor);
  print("the same, if it slept at once", dozing, floor);
  print("the same, a thread for the handler", threaded, floor);
  for (auto& [name, series] :
       {std::pair{"gRPC unary", &grpc}, std::pair{"LCM request/response", &lcm}}) {
    if (series->empty()) {
      fmt::print("  {:<34}{:>10}\n", name, "not measured (not built in, or no multicast on lo)");
    } else {
      print(name, *series, floor);
    }
  }
  const double ratio = ours.median() / floor;
  const double tail = ours.p99() / raw.p99();
  fmt::print("  median ratio {:.2f}   {}\n  p99 ratio {:.2f}   {}\n", ratio,
             verdict(ratio, 1.25, true), tail, verdict(tail, 2, true));
  const bool beats_grpc = grpc.empty() || ours.median() < grpc.median();
  if (!grpc.empty()) {
    fmt::print("  faster than gRPC: {}\n", beats_grpc ? "yes" : "NO");
  }
  return ratio <= 1.25 && tail <= 2 && beats_grpc;
}

double processor_seconds_of(const std::vector<tests::Process>& processes) {
  double seconds = 0;
  for (const tests::Process& process : processes) {
    seconds += processor_seconds(process.pid());
  }
  return seconds;
}

constexpr std::size_t many_channels = 256;
constexpr std::uint32_t many_instances = 4;

/// The best of several rounds, and what a call costs the processor, on average.
struct Throughput {
  double calls_per_second = 0;
  double gateway_time = 0;
  double service_time = 0;
  int rounds = 0;

  void measure(const std::string& kind) {
    constexpr std::size_t calls = 20'000;
    const tests::Domain domain;
    std::vector<tests::Process> services;
    for (std::uint32_t i = 0; i < many_instances; ++i) {
      services.push_back(service(domain.number(), many_channels / many_instances, kind));
    }
    MemoryGateway gateway(domain.number(), many_channels, many_channels);
    gateway.await_instances(many_instances);
    gateway.run(warm_up);
    const double before = processor_seconds_of(services);
    const auto result = gateway.run(calls);
    service_time += 1e6 * (processor_seconds_of(services) - before) / calls;
    gateway_time += result.microseconds_per_call;
    calls_per_second = std::max(calls_per_second, result.calls_per_second);
    ++rounds;
  }

  void print(const char* what, double raw) const {
    fmt::print(
        "  {:<34}{:>10.0f}{:>10.2f}   a call: {:.0f} us in the gateway, {:.0f} us in the "
        "services\n",
        what, calls_per_second, calls_per_second / raw, gateway_time / rounds,
        service_time / rounds);
  }
};

bool measure_throughput() {
  constexpr int rounds = 3;
  constexpr std::size_t raw_calls = 80'000;
  double raw = 0;
  Throughput ours;
  Throughput threaded;
  for (int round = 0; round < rounds; ++round) {
    {
      const tests::Domain domain;
      raw = std::max(
          raw,
          measure_raw(domain.number(), raw_calls, many_channels, many_instances).calls_per_second);
    }
    ours.measure("prompt");
    threaded.measure("service");
  }
  fmt::print(
      "calls per second, {} channels, {} instances, controllers in memory, best of {} rounds\n",
      many_channels, many_instances, rounds);
  fmt::print("  {:<34}{:>10.0f}\n", "raw Cyclone request/reply", raw);
  ours.print("gateway", raw);
  threaded.print("the same, a thread for each handler", raw);
  const double ratio = ours.calls_per_second / raw;
  fmt::print("  ratio {:.2f}   {}\n", ratio, verdict(ratio, 0.7, false));
  measure_over_ads(255);
  return ratio >= 0.7;
}

bool measure_cost() {
  constexpr std::size_t calls = 10'000;
  std::map<std::size_t, double> cost;
  for (const std::size_t number : {std::size_t{1}, std::size_t{1000}}) {
    const tests::Domain domain;
    const auto instance = service(domain.number(), 1, "prompt");
    // The looks at channels that wait are no part of a call: once a second.
    MemoryGateway gateway(domain.number(), number, number, std::chrono::seconds(1));
    gateway.await_instances(1);
    gateway.run(warm_up);
    cost[number] = gateway.run(calls).microseconds_per_call;
  }
  fmt::print(
      "processor time of the gateway for each call: {:.1f} us with 1 channel, {:.1f} us with "
      "1,000   ratio {:.2f}   {}\n",
      cost[1], cost[1000], cost[1000] / cost[1], verdict(cost[1000] / cost[1], 1.2, true));
  return cost[1000] <= 1.2 * cost[1];
}

bool measure_takeover() {
  constexpr int rounds = 20;
  constexpr double goal_seconds = 0.6;
  const tests::Domain domain;
  MemoryGateway gateway(domain.number(), 1, 1);
  std::map<std::uint32_t, tests::Process> services;
  const auto add = [&] {
    tests::Process one = service(domain.number(), 1, "stuck");
    const auto pid = static_cast<std::uint32_t>(one.pid());
    services.emplace(pid, std::move(one));
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
      "kill -9 of an instance -> the call is given to another, {} rounds: median {:.2f} s, "
      "worst {:.2f} s   {}\n",
      rounds, times.median() / 1e6, worst, verdict(worst, goal_seconds, true));
  return worst <= goal_seconds;
}

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

bool measure_alarms(std::chrono::seconds time) {
  // Before there are threads, since it forks.
  const Load load;
  const tests::Domain domain;
  std::vector<tests::Process> services;
  for (int i = 0; i < 4; ++i) {
    services.push_back(service(domain.number(), 1));
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

void serve_peer(const PeerOptions& options) {
  if (options.kind == "raw") {
    serve_raw(options);
  } else if (options.kind == "polling") {
    serve_polling(options);
  } else if (options.kind == "grpc") {
    serve_grpc(options);
  } else if (options.kind == "gateway") {
    serve_gateway(options);
  } else if (options.kind == "lcm") {
    serve_lcm(options);
  } else {
    serve_sdk(options);
  }
}

int run(int argc, char** argv) {
  CLI::App app{"Measures the gateway beside its peers."};
  std::string what;
  std::uint32_t seconds = 60;
  std::vector<std::uint32_t> instances;
  ScalingOptions scaling;
  PresenceOptions presence;
  ScaleOptions scale;
  bool row = false;
  PeerOptions peer;
  app.add_option(
      "what", what,
      "call, throughput, cost, program, load, idle, takeover, alarm, scaling, presence or scale");
  app.add_option("seconds", seconds, "of alarm");
  app.add_option("--instances", instances, "scaling, presence: one row for each number, N,N,…")
      ->delimiter(',')
      ->check(CLI::Range(1, 1000));
  app.add_option("--processes", scaling.processes, "scaling: that share the instances of a row")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--rounds", scaling.rounds, "scaling: of each row")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  std::uint32_t idle_seconds = 0;
  app.add_option("--idle", idle_seconds,
                 "presence, scale: seconds of each row without a call; 24 and 8 if not given")
      ->check(CLI::Range(1, 3600));
  app.add_option("--uuids", presence.uuids, "presence: one process with so many UUIDs instead")
      ->check(CLI::Range(1, 100'000));
  app.add_flag("--no-raw", presence.without_raw, "presence: leave raw Cyclone out");
  app.add_option("--of", scale.of, "scale: what is grown, WORD,WORD,…; all if not given")
      ->delimiter(',')
      ->check(CLI::IsMember(dimensions()));
  app.add_option("--sizes", scale.sizes, "scale: one row for each, N,N,…")->delimiter(',');
  app.add_flag("--row", row)->group("");
  app.add_option("--peer", peer.kind)->group("");
  app.add_option("--domain", peer.domain)->group("");
  app.add_option("--number", peer.number)->group("");
  app.add_option("--count", peer.count)->group("");
  app.add_option("--concurrency", peer.concurrency)->group("");
  app.add_option("--channels", peer.channels)->group("");
  app.add_option("--period", peer.period_ms)->group("");
  app.add_option("--port", peer.port)->group("");
  app.add_option("--machines", peer.machines)->group("");
  app.add_option("--of-uuids", peer.uuids)->group("");
  app.add_option("--interface", peer.interface)->group("");
  CLI11_PARSE(app, argc, argv);
  if (!peer.kind.empty()) {
    try {
      serve_peer(peer);
      return 0;
    } catch (const std::exception& error) {
      remark(error.what());
      return 1;
    }
  }
  if (idle_seconds != 0) {
    presence.idle_seconds = idle_seconds;
    scale.idle_seconds = idle_seconds;
  }
  if (!instances.empty()) {
    scaling.instances = instances;
    presence.instances = instances;
  }
  if (row) {
    try {
      what == "scaling" ? measure_scaling_row(scaling)
      : what == "scale" ? measure_scale_row(scale)
                        : measure_presence_row(presence);
      return 0;
    } catch (const std::exception& error) {
      remark(error.what());
      return 1;
    }
  }
  const std::map<std::string, std::function<bool()>> measurements{
      {"call", measure_call},
      {"throughput", measure_throughput},
      {"cost", measure_cost},
      {"program", measure_program},
      {"load", measure_controller_load},
      {"idle", measure_idle},
      {"takeover", measure_takeover},
      {"alarm", [&] { return measure_alarms(std::chrono::seconds(seconds)); }},
      {"scaling", [&] { return measure_scaling(scaling); }},
      {"presence", [&] { return measure_presence(presence); }},
      {"scale", [&] { return measure_scale(scale); }}};
  const auto found = measurements.find(what);
  if (found == measurements.end()) {
    fmt::print(stderr, "{}", app.help());
    return 2;
  }
  return found->second() ? 0 : 1;
}

}  // namespace

}  // namespace millrace::bench

int main(int argc, char** argv) {
  return millrace::bench::run(argc, argv);
}
