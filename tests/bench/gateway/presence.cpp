#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <thread>

#include <fmt/format.h>

#include "tests/bench/gateway/fleet.hpp"
#include "tests/bench/gateway/measurements.hpp"
#include "tests/bench/gateway/memory_gateway.hpp"
#include "tests/bench/gateway/raw_dds.hpp"
#include "tests/bench/gateway/rows.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/support/domain.hpp"

namespace millrace::bench {

namespace {

using std::chrono::seconds;

/// The longest wait of a row, from the last start on, until all are known and settled.
constexpr seconds patience{60};
/// For the warm-up calls and for the measured ones.
constexpr seconds patience_of_calls{20};
constexpr std::size_t calls = 2000;
/// At least this many, plus a few for each instance.
constexpr std::size_t warm_up = 500;
constexpr std::size_t warm_up_of_instance = 5;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Lets this much time pass while the gateway's loop runs.
using Pass = std::function<void(seconds)>;

/// Processor time of this process and of the others, separately.
class Use {
 public:
  explicit Use(const std::vector<const Fleet*>& fleets) : fleets_(fleets) { restart(); }

  void restart() {
    start_ = Clock::now();
    own_ = own_processor_microseconds() / 1e6;
    of_fleets_ = seconds_of_fleets();
  }
  /// Since then, in % of one core.
  [[nodiscard]] double own() const {
    return 100 * (own_processor_microseconds() / 1e6 - own_) / seconds_since(start_);
  }
  [[nodiscard]] double of_fleets() const {
    return 100 * (seconds_of_fleets() - of_fleets_) / seconds_since(start_);
  }

 private:
  [[nodiscard]] double seconds_of_fleets() const {
    double all = 0;
    for (const Fleet* fleet : fleets_) {
      all += fleet->processor_seconds();
    }
    return all;
  }

  std::vector<const Fleet*> fleets_;
  Clock::time_point start_;
  double own_ = 0;
  double of_fleets_ = 0;
};

/// Waits until two consecutive seconds take about the same processor time and the cores are not
/// fully used: start-up work is then done. Returns when the first of them began; nothing after
/// `patience`.
std::optional<Clock::time_point> settle(Use& use, Clock::time_point started, const Pass& pass) {
  constexpr double same = 0.15;
  constexpr double little = 2;
  const double saturated = 90.0 * std::thread::hardware_concurrency();
  double before = saturated;
  while (Clock::now() - started < patience) {
    use.restart();
    pass(seconds(1));
    const double now = use.own() + use.of_fleets();
    if (now < saturated && std::abs(now - before) <= std::max(same * before, little)) {
      return Clock::now() - seconds(2);
    }
    before = now;
  }
  return std::nullopt;
}

/// Settles and measures, from `started` on; the names of the figures begin with `prefix`.
void report_idle(const std::string& prefix, const std::vector<const Fleet*>& fleets,
                 Clock::time_point started, const PresenceOptions& options, const Pass& pass) {
  Use use(fleets);
  if (const auto settled = settle(use, started, pass)) {
    tell_row({{prefix + "settled", std::chrono::duration<double>(*settled - started).count()}});
  }
  use.restart();
  pass(seconds(options.idle_seconds));
  const double own = use.own();
  const double of_fleets = use.of_fleets();
  tell_row({{prefix + "own", own},
            {prefix + "others", of_fleets},
            {prefix + "processor", own + of_fleets}});
}

/// One call at a time after a warm-up; nothing if they are not answered.
template <typename Run>
std::optional<double> report_calls(const std::string& prefix, std::size_t instances,
                                   const Run& run) {
  if (!run(std::max(warm_up, warm_up_of_instance * instances))) {
    return std::nullopt;
  }
  auto result = run(calls);
  if (!result) {
    return std::nullopt;
  }
  const double median = result->second.median();
  tell_row({{prefix + "calls_per_second", result->first},
            {prefix + "median", median},
            {prefix + "p99", result->second.p99()}});
  return median;
}

template <typename Result, typename Times>
std::optional<std::pair<double, Series>> rate_and_times(std::optional<Result> result, Times times) {
  if (!result) {
    return std::nullopt;
  }
  return std::pair{result->calls_per_second, std::move((*result).*times)};
}

void measure_with_gateway(std::uint32_t instances, const PresenceOptions& options) {
  const tests::Domain domain;
  const PeerOptions service{.kind = "inline", .domain = domain.number()};
  MemoryGateway gateway(domain.number(), 1, 1);
  const auto run = [&](std::size_t count) {
    return rate_and_times(gateway.run_within(count, patience_of_calls),
                          &MemoryGateway::Result::replied);
  };
  const auto know = [&](std::size_t count) {
    return gateway.run_until([&] { return gateway.instances() >= count; }, patience);
  };
  Fleet first(service, 1, 1);
  if (!know(1)) {
    return;
  }
  const auto alone = report_calls("one_", 1, run);

  Fleet others(service, instances - 1, instances - 1);
  if (know(instances)) {
    tell_row({{"known", seconds_since(others.started())}});
  }
  report_idle("", {&first, &others}, others.started(), options,
              [&](seconds time) { gateway.run_until([] { return false; }, time); });
  const auto lost = gateway.lost();
  if (const auto many = report_calls("", instances, run); many && alone) {
    tell_row({{"ratio", *many / *alone}});
  }
  auto died = first.ended();
  std::ranges::copy(others.ended(), std::back_inserter(died));
  remark(others.problem());
  tell_row({{"died", static_cast<double>(died.size())},
            {"lost", static_cast<double>(lost)},
            {"knows", static_cast<double>(gateway.instances())}});
  if (!died.empty()) {
    tell_row({{"died_of", died.front()}});
  }
}

void measure_with_raw(std::uint32_t peers, const PresenceOptions& options) {
  const tests::Domain domain;
  const PeerOptions peer{.kind = "raw", .domain = domain.number()};
  const Fleet echoes(peer, peers, peers);
  RawRequester requester(domain.number(), peers);
  if (!requester.await_peers(patience)) {
    return;
  }
  tell_row({{"raw_known", seconds_since(echoes.started())}});
  report_idle("raw_", {&echoes}, echoes.started(), options,
              [](seconds time) { std::this_thread::sleep_for(time); });
  report_calls("raw_", peers, [&](std::size_t count) {
    return rate_and_times(requester.run(count, 1, patience_of_calls), &RawResult::round_trips);
  });
}

/// One process with this many UUIDs: the time from its start until the gateway knows all, and its
/// resources.
void measure_uuids(const PresenceOptions& options) {
  const tests::Domain domain;
  MemoryGateway gateway(domain.number(), 1, 1);
  Fleet services({.kind = "uuids", .domain = domain.number()}, options.uuids, 1);
  const double before = own_processor_microseconds();
  if (gateway.run_until([&] { return gateway.instances() >= options.uuids; }, patience)) {
    tell_row({{"known", seconds_since(services.started())}});
  }
  tell_row({{"knows", static_cast<double>(gateway.instances())},
            {"gateway_seconds", (own_processor_microseconds() - before) / 1e6},
            {"service_seconds", services.processor_seconds()},
            {"died", static_cast<double>(services.ended().size())}});
}

// ---- Tables and goals

constexpr double goal_processor = 20;
constexpr double goal_known = 3;
constexpr double goal_ratio = 1.3;
constexpr double goal_settled = 10;
constexpr double goal_uuids = 5;
/// The first three goals apply to rows up to this many instances, the fourth to all.
constexpr std::uint32_t judged = 100;

std::string line(std::uint32_t instances, const Row& row) {
  const auto waited = [&](const std::string& name) {
    return row.has(name) ? row.text(name, 1) : fmt::format("> {}", patience.count());
  };
  const auto times = [&](const std::string& prefix) {
    return row.text(prefix + "median") + " / " + row.text(prefix + "p99");
  };
  return fmt::format(
      "{:>3} instances{:>9}{:>15}{:>12}{:>7}{:>7}{:>8}{:>7} = {:>4} + {:<5}{:>6}{:>6}"
      "  |{:>9}{:>13}{:>7}{:>8}{:>7}\n",
      instances, row.text("calls_per_second"), times(""), times("one_"), row.text("ratio", 2),
      waited("known"), waited("settled"), row.text("processor", 1), row.text("own", 1),
      row.text("others", 1), row.text("died"), row.text("lost"), row.text("raw_calls_per_second"),
      times("raw_"), waited("raw_known"), waited("raw_settled"), row.text("raw_processor", 1));
}

std::string header() {
  return fmt::format(
      "{:>13}{:>9}{:>15}{:>12}{:>7}{:>7}{:>8}{:>7}{:>15}{:>6}{:>6}"
      "  |{:>9}{:>13}{:>7}{:>8}{:>7}\n",
      "", "calls/s", "p50 / p99 us", "with 1", "ratio", "known", "settled", "idle",
      " = gw + services", "died", "lost", "raw c/s", "p50 / p99", "known", "settled", "idle");
}

bool within(const Row& row, const std::string& name, double goal) {
  return row.has(name) && row.get(name) <= goal;
}

/// The missed goals of the row as text; nothing if all are met.
std::string missed(std::uint32_t instances, const Row& row) {
  std::string what;
  const auto check_goal = [&](bool met, const std::string& goal) {
    what += met ? "" : (what.empty() ? "" : ", ") + goal;
  };
  if (instances <= judged) {
    check_goal(within(row, "processor", goal_processor),
               fmt::format("idle at most {:g} % of a core", goal_processor));
    check_goal(within(row, "known", goal_known), fmt::format("known within {:g} s", goal_known));
    check_goal(within(row, "ratio", goal_ratio),
               fmt::format("p50 at most {:g} of that with 1", goal_ratio));
  }
  check_goal(within(row, "settled", goal_settled),
             fmt::format("settled within {:g} s", goal_settled));
  check_goal(row.has("calls_per_second"), "calls are answered");
  check_goal(within(row, "died", 0), "none died");
  return what;
}

bool measure_many_uuids(const PresenceOptions& options) {
  const Row row =
      measure_row({"presence", "--uuids", std::to_string(options.uuids)}, seconds(30) + patience);
  if (row.has("known")) {
    fmt::print("{} UUIDs in one process: ready after {} s", options.uuids, row.text("known", 2));
  } else {
    fmt::print("{} UUIDs in one process: {} ready after {} s, {}", options.uuids, row.text("knows"),
               patience.count(), row.get("died") > 0 ? "it died" : "it runs");
  }
  fmt::print("; processor time {} s of the process, {} s of the gateway   {}\n{}",
             row.text("service_seconds", 2), row.text("gateway_seconds", 2),
             row.has("known") ? verdict(row.get("known"), goal_uuids, true) : "MISSED",
             row.trouble);
  return within(row, "known", goal_uuids);
}

}  // namespace

bool measure_presence(const PresenceOptions& options) {
  if (options.uuids > 0) {
    return measure_many_uuids(options);
  }
  fmt::print(
      "service processes of one UUID, started at once, and a gateway, its controller in memory\n"
      "  calls: one at a time, accepted -> replied, p50 / p99 in us\n"
      "  known, settled: seconds since the last start; lost: taken for gone by the gateway\n"
      "  idle: processor time over {} s once settled or given up, % of one core\n"
      "  behind the bar: raw Cyclone with as many processes, its lease DDS's ordinary one\n{}",
      options.idle_seconds, header());
  std::string misses;
  for (const std::uint32_t instances : options.instances) {
    std::vector<std::string> arguments{"presence", "--instances", std::to_string(instances),
                                       "--idle", std::to_string(options.idle_seconds)};
    if (options.without_raw) {
      arguments.emplace_back("--no-raw");
    }
    const Row row = measure_row(std::move(arguments), 5 * patience + 4 * patience_of_calls +
                                                          2 * seconds(options.idle_seconds));
    fmt::print("{}", line(instances, row));
    if (row.has("died_of")) {
      fmt::print("  the first that died: exit code {} (128 + signal)\n", row.text("died_of"));
    }
    fmt::print("{}", row.trouble);
    std::fflush(stdout);
    if (const std::string what = missed(instances, row); !what.empty()) {
      misses += fmt::format("  {} instances, MISSED: {}\n", instances, what);
    }
  }
  fmt::print("{}", misses.empty() ? "  all goals met\n" : misses);
  return misses.empty();
}

void measure_presence_row(const PresenceOptions& options) {
  if (options.uuids > 0) {
    measure_uuids(options);
    return;
  }
  const std::uint32_t instances = options.instances.front();
  measure_with_gateway(instances, options);
  if (!options.without_raw) {
    measure_with_raw(instances, options);
  }
}

}  // namespace millrace::bench
