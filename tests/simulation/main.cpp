// millrace-simulation: runs simulations by their seeds, or every order of a small one.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <deque>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>
#include <fmt/chrono.h>
#include <fmt/format.h>

#include "tests/simulation/exhaustive/small_plant.hpp"
#include "tests/simulation/shrink.hpp"
#include "tests/simulation/world.hpp"

namespace {

namespace cnc = millrace::cnc;
namespace fabric = millrace::fabric;
using namespace millrace::tests::simulation;

struct Flags {
  std::string seeds = "1..500";
  std::uint64_t seed = 0;
  /// The number of new seeds, drawn from the text below.
  std::uint64_t fresh = 0;
  std::string from;
  bool trace = false;
  std::string bug;
  unsigned most = 10;
  Limits limits;
  std::vector<std::string> quiet;
  std::vector<std::string> without;
  std::int64_t faults_for = 0;
  bool reach = false;
  // Options of a walk through every order.
  std::string mishap;
  SmallPlan plan;
  bool once = false;
  std::size_t runs = 1'000'000;
  unsigned early_timers = 0;
  std::size_t drawn = 0;
};

Bug bug_of(const std::string& name) {
  for (const BugName& bug_name : bug_names) {
    if (bug_name.name == name) {
      return bug_name.bug;
    }
  }
  return Bug::none;
}

std::pair<std::uint64_t, std::uint64_t> range_of(const std::string& seeds) {
  const auto dots = seeds.find("..");
  const std::uint64_t first = std::stoull(seeds.substr(0, dots));
  return {first, dots == std::string::npos ? first : std::stoull(seeds.substr(dots + 2))};
}

/// The first of the new seeds for a text.
std::uint64_t first_fresh(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325U;  // FNV-1a
  for (const char letter : text) {
    hash = (hash ^ static_cast<unsigned char>(letter)) * 0x100000001b3U;
  }
  // Larger than seeds that people choose, and still short enough to type.
  return (std::uint64_t{1} << 40U) + (Random(hash).next() >> 25U);
}

std::pair<std::uint64_t, std::uint64_t> seeds_of(const Flags& flags) {
  if (flags.fresh > 0) {
    const std::uint64_t first = first_fresh(flags.from);
    return {first, first + flags.fresh - 1};
  }
  return flags.seed != 0 ? std::pair(flags.seed, flags.seed) : range_of(flags.seeds);
}

std::string today() {
  return fmt::format("{:%F}", fmt::gmtime(std::time(nullptr)));
}

/// Prints the end of the smallest simulation that still breaks the same promise.
void print_small(std::uint64_t seed, Options options, const Outcome& failed) {
  constexpr std::size_t most_lines = 60;
  options.limits = shrink(seed, options, failed);
  std::deque<std::string> lines;
  options.trace = [&lines](const std::string& line) {
    lines.push_back(line);
    if (lines.size() > most_lines) {
      lines.pop_front();
    }
  };
  World(seed, options).run();
  fmt::print("  smallest failing simulation: {}\n  its end:\n  {}\n",
             replay(seed, options.bug, options.limits), fmt::join(lines, "\n  "));
  std::fflush(stdout);
}

/// How often each kind of fault hit a channel in each state.
void print(const FaultInjector::Coverage& coverage) {
  fmt::print("{:<24}", "fault");
  for (const std::string_view step : FaultInjector::steps) {
    fmt::print("{:>12}", step);
  }
  for (const std::string& fault : FaultInjector::names()) {
    fmt::print("\n{:<24}", fault);
    for (const std::string_view step : FaultInjector::steps) {
      const auto found = coverage.find({fault, step});
      fmt::print("{:>12}", found == coverage.end() ? 0 : found->second);
    }
  }
  fmt::print("\n");
}

int run(const Flags& flags) {
  const auto [first, last] = seeds_of(flags);
  if (flags.fresh > 0) {
    fmt::print("seeds {}..{}, drawn from \"{}\"\n", first, last, flags.from);
    std::fflush(stdout);
  }
  const auto begin = std::chrono::steady_clock::now();
  unsigned failed = 0;
  std::size_t answered = 0;
  Time virtual_time{};
  std::uint64_t runs = 0;
  FaultInjector::Coverage coverage;
  for (std::uint64_t seed = first; seed <= last && failed < flags.most; ++seed) {
    Options options;
    options.bug = bug_of(flags.bug);
    options.limits = flags.limits;
    if (flags.trace) {
      options.trace = [](const std::string& line) { fmt::print("{}\n", line); };
    }
    World world(seed, options);
    const Outcome outcome = world.run();
    ++runs;
    answered += outcome.answered;
    virtual_time += outcome.took;
    for (const auto& [pair, times] : outcome.coverage) {
      coverage[pair] += times;
    }
    if (!outcome.violations.empty()) {
      ++failed;
      fmt::print("seed {}: {}\n  replay: {}\n", seed, fmt::join(outcome.violations, "\n  "),
                 replay(seed, options.bug, options.limits));
      std::fflush(stdout);
      if (!flags.trace && options.limits == Limits{}) {
        print_small(seed, options, outcome);
      }
    }
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  fmt::print("{} seeds, {} failed; {} calls answered in {:.0f} virtual seconds, {:.1f} real ones\n",
             runs, failed, answered, std::chrono::duration<double>(virtual_time).count(),
             took.count());
  if (flags.reach) {
    print(coverage);
  }
  return failed == 0 ? 0 : 1;
}

/// The number of runs in random orders that come to a sight that the walk has not seen.
std::size_t unseen(const Flags& flags, Bounds bounds) {
  const auto walked = sights(flags.plan, bounds);
  bounds.most_runs = flags.drawn;
  bounds.draw = 1;
  const auto drawn = sights(flags.plan, bounds);
  const auto missing =
      std::ranges::count_if(drawn, [&](const auto& sight) { return !walked.contains(sight); });
  fmt::print("{} sights in {} random orders, {} in the walk, which misses {} of the former\n",
             drawn.size(), flags.drawn, walked.size(), missing);
  return static_cast<std::size_t>(missing);
}

int walk(Flags flags) {
  const auto mishap = std::ranges::find(mishap_names, flags.mishap, &MishapName::name);
  flags.plan.mishap = mishap->mishap;
  flags.plan.delivery =
      flags.once ? fabric::Delivery::at_most_once : fabric::Delivery::at_least_once;
  flags.plan.bug = bug_of(flags.bug);
  const Bounds bounds{.early_timers = flags.early_timers, .most_runs = flags.runs};
  const auto begin = std::chrono::steady_clock::now();
  const Walk walked = walk_through(flags.plan, bounds);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  if (flags.trace && !walked.violations.empty()) {
    fmt::print("{}\n", fmt::join(retell(flags.plan, bounds, walked), "\n"));
  }
  const char* rest = walked.complete ? "" : " (not all)";
  fmt::print("{} states, {} runs{}, {:.1f} s: {}\n", walked.states, walked.runs, rest, took.count(),
             walked.violations.empty() ? "every promise is kept" : walked.violations.front());
  if (!walked.violations.empty()) {
    return 1;
  }
  return flags.drawn > 0 && unseen(flags, bounds) > 0 ? 1 : 0;
}

/// The names of all entries of an array.
template <typename Names>
std::vector<std::string> names_of(const Names& all) {
  std::vector<std::string> names;
  for (const auto& name : all) {
    names.emplace_back(name.name);
  }
  return names;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Simulates plants with gateways and services in virtual time, with faults."};
  Flags flags;
  app.add_option("--seeds", flags.seeds, "FIRST..LAST: the simulations to run");
  app.add_option("--seed", flags.seed, "One simulation");
  flags.from = today();
  app.add_option("--fresh", flags.fresh, "Run this many new seeds instead, drawn from a text");
  app.add_option("--from", flags.from, "That text (default: today's date)")
      ->envname("MILLRACE_SEEDS_FROM");
  app.add_flag("--trace", flags.trace, "Print all events");
  app.add_option("--bug", flags.bug, "A deliberate mistake (docs/dev/simulation.md)")
      ->check(CLI::IsMember(names_of(bug_names)));
  app.add_option("--most", flags.most, "Stop after this many failures");
  app.add_option("--quiet", flags.quiet,
                 "Channels and queues whose programs send nothing: m0/3,m1.q0/2")
      ->delimiter(',');
  app.add_option("--without", flags.without, "Kinds of faults to leave out")
      ->delimiter(',')
      ->check(CLI::IsMember(FaultInjector::names()));
  app.add_option("--faults-for", flags.faults_for, "Faults end after this many nanoseconds");
  app.add_flag("--reach", flags.reach,
               "Print how often each kind of fault hit a channel in each state");
  auto* orders = app.add_option("--every-order", flags.mishap,
                                "Walk every order of one channel, two instances and this mishap")
                     ->check(CLI::IsMember(names_of(mishap_names)));
  const auto of_orders = [&](CLI::Option* option) { option->needs(orders)->group("Every order"); };
  cnc::simulator::ServiceRules& rules = flags.plan.rules;
  of_orders(app.add_option("--runs", flags.runs, "Stop after this many runs"));
  of_orders(app.add_option("--calls", flags.plan.calls, "Calls of the program"));
  of_orders(app.add_flag("--once", flags.once, "The service is at most once"));
  of_orders(app.add_flag("--writes-lost", flags.plan.leftovers_dropped,
                         "Requests under way to the controller are lost with their connection"));
  of_orders(app.add_flag("--response-clears-request", rules.response_clears_request,
                         "The kernel clears REQUEST_STATE when RESPONSE_STATE is written"));
  of_orders(app.add_flag("--reset-clears-states", rules.reset_clears_states,
                         "An NC reset clears both states"));
  of_orders(app.add_option("--early-timers", flags.early_timers,
                           "How many times a timer may fire before another possible event"));
  of_orders(
      app.add_option("--draw", flags.drawn,
                     "Then take this many random orders and report what the walk has missed"));
  CLI11_PARSE(app, argc, argv);
  flags.limits.quiet.insert(flags.quiet.begin(), flags.quiet.end());
  flags.limits.without.insert(flags.without.begin(), flags.without.end());
  if (flags.faults_for > 0) {
    flags.limits.faults_for = Time(flags.faults_for);
  }
  return flags.mishap.empty() ? run(flags) : walk(flags);
}
