#include <functional>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "tests/bench/gateway/measurements.hpp"
#include "tests/bench/gateway/memory_gateway.hpp"
#include "tests/bench/gateway/peers.hpp"
#include "tests/bench/gateway/raw_dds.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/support/domain.hpp"

namespace millrace::bench {

namespace {

constexpr std::size_t warm_up = 1000;
/// Approximate size of a request on the wire in bytes.
constexpr std::size_t message_size = 200;

void print(const char* what, Series series, double floor) {
  fmt::print("  {:<34}{:>10.1f}{:>10.1f}{:>10.2f}\n", what, series.median(), series.p99(),
             series.median() / floor);
}

/// Measures calls with one service of this kind; `also` is called before the end.
void measure_gateway(const std::string& kind, std::size_t calls, Series& replied,
                     const std::function<void(MemoryGateway&)>& also = {}) {
  const tests::Domain domain;
  const auto instance = start_service(domain.number(), 1, kind);
  MemoryGateway gateway(domain.number(), 1, 1);
  gateway.await_instances(1);
  gateway.run(warm_up);
  replied.add(gateway.run(calls).replied);
  if (also) {
    also(gateway);
  }
}

}  // namespace

bool measure_call() {
  constexpr std::size_t rounds = 5;
  constexpr std::size_t calls = 4000;
  Series through_gateway;
  Series threaded;
  Series dozing;
  Series raw;
  Series datagrams;
  double datagram = 0;
  Series nats;
  Series grpc;
  Series lcm;
  for (std::size_t round = 0; round < rounds; ++round) {
    const Datagrams udp = measure_datagrams(calls, message_size);
    datagrams.add(udp.round_trips);
    datagram += udp.microseconds / rounds;
    {
      const tests::Domain domain;
      measure_raw(domain.number(), warm_up, 1, 1);
      raw.add(measure_raw(domain.number(), calls, 1, 1).round_trips);
    }
    measure_gateway("inline", calls, through_gateway, [&](MemoryGateway& gateway) {
      gateway.doze();
      dozing.add(gateway.run(calls).replied);
    });
    measure_gateway("service", calls, threaded);
    if (auto result = measure_nats({.calls = calls, .size = message_size})) {
      nats.add(result->requester.round_trips);
    }
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
  print("UDP ping-pong of two processes", datagrams, floor);
  print("raw Cyclone ping-pong (listener)", raw, floor);
  print("gateway: accepted -> reply received", through_gateway, floor);
  print("the same, sleeping without spinning", dozing, floor);
  print("the same, a thread for the handler", threaded, floor);
  for (auto& [name, series] :
       {std::pair{"NATS request, queue group", &nats}, std::pair{"gRPC unary", &grpc},
        std::pair{"LCM request/response", &lcm}}) {
    if (series->empty()) {
      fmt::print("  {:<34}{:>10}\n", name, "not measured (not built in, or no multicast on lo)");
    } else {
      print(name, *series, floor);
    }
  }
  fmt::print("  one datagram, sent and received in one thread: {:.1f} us of processor time\n",
             datagram);
  const double ratio = through_gateway.median() / floor;
  const double tail = through_gateway.p99() / raw.p99();
  fmt::print("  median ratio {:.2f}   {}\n  p99 ratio {:.2f}   {}\n", ratio,
             verdict(ratio, 1.25, true), tail, verdict(tail, 2, true));
  if (!nats.empty()) {
    fmt::print("  to NATS {:.2f}   {}\n", through_gateway.median() / nats.median(),
               verdict(through_gateway.median() / nats.median(), 0.25, true));
  }
  const bool beats_grpc = grpc.empty() || through_gateway.median() < grpc.median();
  if (!grpc.empty()) {
    fmt::print("  faster than gRPC: {}\n", beats_grpc ? "yes" : "NO");
  }
  return ratio <= 1.25 && tail <= 2 && beats_grpc;
}

namespace {

double processor_seconds_of(const std::vector<tests::Process>& processes) {
  double seconds = 0;
  for (const tests::Process& process : processes) {
    seconds += processor_seconds(process.pid());
  }
  return seconds;
}

constexpr std::size_t many_channels = 256;
constexpr std::uint32_t many_instances = 4;

/// The best of several rounds, and the average processor time of a call.
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
      services.push_back(start_service(domain.number(), many_channels / many_instances, kind));
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

}  // namespace

bool measure_throughput() {
  constexpr int rounds = 3;
  constexpr std::size_t raw_calls = 80'000;
  double raw = 0;
  Throughput through_gateway;
  Throughput threaded;
  for (int round = 0; round < rounds; ++round) {
    {
      const tests::Domain domain;
      raw = std::max(
          raw,
          measure_raw(domain.number(), raw_calls, many_channels, many_instances).calls_per_second);
    }
    through_gateway.measure("inline");
    threaded.measure("service");
  }
  fmt::print(
      "calls per second, {} channels, {} instances, controllers in memory, best of {} rounds\n",
      many_channels, many_instances, rounds);
  fmt::print("  {:<34}{:>10.0f}\n", "raw Cyclone request/reply", raw);
  through_gateway.print("gateway", raw);
  threaded.print("the same, a thread for each handler", raw);
  const double ratio = through_gateway.calls_per_second / raw;
  fmt::print("  ratio {:.2f}   {}\n", ratio, verdict(ratio, 0.7, false));
  measure_over_ads(255);
  return ratio >= 0.7;
}

bool measure_cost() {
  constexpr std::size_t calls = 10'000;
  std::map<std::size_t, double> cost;
  for (const std::size_t number : {std::size_t{1}, std::size_t{1000}}) {
    const tests::Domain domain;
    const auto instance = start_service(domain.number(), 1, "inline");
    // Reads of waiting channels are not part of a call: they happen once a second.
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

}  // namespace millrace::bench
