#include <algorithm>
#include <map>
#include <stdexcept>

#include <fmt/format.h>

#include "tests/bench/gateway/fleet.hpp"
#include "tests/bench/gateway/measurements.hpp"
#include "tests/bench/gateway/memory_gateway.hpp"
#include "tests/bench/gateway/raw_dds.hpp"
#include "tests/bench/gateway/rows.hpp"
#include "tests/support/domain.hpp"

namespace millrace::bench {

namespace {

using std::chrono::seconds;

constexpr std::uint32_t in_flight = 256;
constexpr std::size_t warm_up = 2000;
/// One round of either kind; a row takes about twice as long.
constexpr double seconds_of_round = 2;
constexpr std::size_t least_calls = 2000;
constexpr std::size_t most_calls = 400'000;
/// For discovery of the instances, and for a round.
constexpr seconds patience{60};

constexpr double goal_of_many = 0.8;
constexpr double goal_beside_raw = 0.5;
constexpr double goal_of_services = 1.5;

/// The number of calls in a round at the pace of the warm-up.
std::size_t calls_of_round(double calls_per_second) {
  return std::clamp(static_cast<std::size_t>(seconds_of_round * calls_per_second), least_calls,
                    most_calls);
}

/// The best rate of the rounds, and the average cost of a call.
struct Rounds {
  double calls_per_second = 0;
  double asking = 0;
  double answering = 0;
  int count = 0;

  void add(double rate, double asking_microseconds, double answering_microseconds) {
    calls_per_second = std::max(calls_per_second, rate);
    asking += (asking_microseconds - asking) / ++count;
    answering += (answering_microseconds - answering) / count;
  }
};

[[noreturn]] void give_up(std::string_view what) {
  throw std::runtime_error(fmt::format("{} within {} s", what, patience.count()));
}

/// A round of a gateway or a raw requester: warms up, then measures the calls that fit in its time.
template <typename Requester>
void add_round(const char* whose, Rounds& rounds, const Fleet& fleet, const Requester& run) {
  const auto warm = run(warm_up);
  if (!warm) {
    give_up(fmt::format("the calls of {} to warm up were not answered", whose));
  }
  const std::size_t calls = calls_of_round(warm->calls_per_second);
  const double before = fleet.processor_seconds();
  const auto result = run(calls);
  remark(fleet.problem());
  if (!result) {
    give_up(fmt::format("the calls of {} were not answered", whose));
  }
  rounds.add(result->calls_per_second, result->microseconds_per_call,
             1e6 * (fleet.processor_seconds() - before) / static_cast<double>(calls));
}

void add_round_of_gateway(Rounds& rounds, std::uint32_t instances, std::uint32_t processes) {
  const tests::Domain domain;
  const Fleet services({.kind = "inline",
                        .domain = domain.number(),
                        .concurrency = (in_flight + instances - 1) / instances},
                       instances, processes);
  MemoryGateway gateway(domain.number(), in_flight, in_flight);
  if (!gateway.run_until([&] { return gateway.instances() >= instances; }, patience)) {
    give_up("the gateway did not know all instances");
  }
  add_round("the gateway", rounds, services,
            [&](std::size_t calls) { return gateway.run_within(calls, patience); });
}

void add_round_of_raw(Rounds& rounds, std::uint32_t peers, std::uint32_t processes) {
  const tests::Domain domain;
  const Fleet echoes({.kind = "raw", .domain = domain.number()}, peers, processes);
  RawRequester requester(domain.number(), peers);
  if (!requester.await_peers(patience)) {
    give_up("the raw peers were not matched");
  }
  add_round("raw Cyclone", rounds, echoes,
            [&](std::size_t calls) { return requester.run(calls, in_flight, patience); });
}

/// A round of NATS; the cost of a call is that of its requester and server together.
void add_round_of_nats(Rounds& rounds, std::uint32_t instances, std::uint32_t processes) {
  NatsLoad load{
      .calls = warm_up, .in_flight = in_flight, .instances = instances, .processes = processes};
  const auto warm = measure_nats(load);
  if (!warm) {
    return;
  }
  load.calls = calls_of_round(warm->requester.calls_per_second);
  if (const auto result = measure_nats(load)) {
    rounds.add(result->requester.calls_per_second,
               result->requester.microseconds_per_call + result->server, result->peers);
  }
}

std::string line(std::uint32_t instances, const Row& row) {
  return fmt::format("{:>3} instances{:>10}{:>12}{:>8}{:>12}{:>8}{:>12}{:>12}{:>14}{:>14}{:>14}\n",
                     instances, row.text("calls_per_second"), row.text("raw_calls_per_second"),
                     row.text("ratio", 2), row.text("nats_calls_per_second"),
                     row.text("nats_ratio", 2), row.text("gateway", 1), row.text("services", 1),
                     row.text("raw_requester", 1), row.text("raw_peers", 1), row.text("nats", 1));
}

/// Prints the result for one goal and returns whether it is met.
bool judge(const std::string& what, double value, double goal, bool at_most) {
  fmt::print("  {:<56}{:.2f}   {}\n", what, value, verdict(value, goal, at_most));
  return at_most ? value <= goal : value >= goal;
}

bool judge(const std::map<std::uint32_t, Row>& rows) {
  constexpr std::uint32_t most_beside_raw = 16;
  bool met = true;
  for (const auto& [instances, row] : rows) {
    if (instances <= most_beside_raw && row.has("ratio")) {
      met &= judge(fmt::format("calls/s with {}, of those of raw Cyclone", instances),
                   row.get("ratio"), goal_beside_raw, false);
    }
  }
  const auto& [fewest, first] = *rows.begin();
  const auto& [most, last] = *rows.rbegin();
  if (most > fewest && first.has("ratio") && last.has("ratio")) {
    met &= judge(fmt::format("calls/s with {}, of those with {}", most, fewest),
                 last.get("calls_per_second") / first.get("calls_per_second"), goal_of_many, false);
    met &= judge(fmt::format("services' processor time with {}, of that with {}", most, fewest),
                 last.get("services") / first.get("services"), goal_of_services, true);
  }
  return met;
}

}  // namespace

bool measure_scaling(const ScalingOptions& options) {
  fmt::print(
      "{} calls in flight, controllers in memory, inline handlers; instances of one UUID in at\n"
      "most {} processes, and as many peers of raw Cyclone and of NATS; best of {} rounds. "
      "Processor\n"
      "time for each call in us: mean of the rounds, with the kernel's; NATS: all its processes.\n"
      "{:>13}{:>10}{:>12}{:>8}{:>12}{:>8}{:>12}{:>12}{:>14}{:>14}{:>14}\n",
      in_flight, options.processes, options.rounds, "", "calls/s", "raw calls/s", "ratio", "NATS",
      "ratio", "us: gateway", "services", "raw: requester", "raw: peers", "NATS");
  std::map<std::uint32_t, Row> rows;
  bool complete = true;
  for (const std::uint32_t instances : options.instances) {
    const Row row =
        measure_row({"scaling", "--instances", std::to_string(instances), "--processes",
                     std::to_string(options.processes), "--rounds", std::to_string(options.rounds)},
                    seconds(30) + 8 * patience);
    fmt::print("{}", line(instances, row));
    fmt::print("{}", row.trouble);
    complete &= row.has("ratio");
    std::fflush(stdout);
    rows[instances] = row;
  }
  return judge(rows) && complete;
}

void measure_scaling_row(const ScalingOptions& options) {
  const std::uint32_t instances = options.instances.front();
  const std::uint32_t processes = std::min(instances, options.processes);
  Rounds gateway;
  Rounds raw;
  Rounds nats;
  for (std::uint32_t round = 0; round < options.rounds; ++round) {
    add_round_of_raw(raw, instances, processes);
    tell_row({{"raw_calls_per_second", raw.calls_per_second},
              {"raw_requester", raw.asking},
              {"raw_peers", raw.answering}});
    add_round_of_gateway(gateway, instances, processes);
    tell_row({{"calls_per_second", gateway.calls_per_second},
              {"gateway", gateway.asking},
              {"services", gateway.answering},
              {"ratio", gateway.calls_per_second / raw.calls_per_second}});
    add_round_of_nats(nats, instances, processes);
    if (nats.count > 0) {
      tell_row({{"nats_calls_per_second", nats.calls_per_second},
                {"nats_ratio", gateway.calls_per_second / nats.calls_per_second},
                {"nats", nats.asking + nats.answering}});
    }
  }
}

}  // namespace millrace::bench
