// millrace-simulation: runs simulations by their seeds.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "tests/simulation/world.hpp"

namespace {

using namespace millrace::tests::simulation;

struct Flags {
  std::string seeds = "1..500";
  std::uint64_t seed = 0;
  bool trace = false;
  std::string bug;
  unsigned most = 10;
};

Bug bug_of(const std::string& name) {
  for (const BugName& one : bug_names) {
    if (one.name == name) {
      return one.bug;
    }
  }
  return Bug::none;
}

std::pair<std::uint64_t, std::uint64_t> range_of(const std::string& seeds) {
  const auto dots = seeds.find("..");
  const std::uint64_t first = std::stoull(seeds.substr(0, dots));
  return {first, dots == std::string::npos ? first : std::stoull(seeds.substr(dots + 2))};
}

int run(const Flags& flags) {
  const auto [first, last] =
      flags.seed != 0 ? std::pair(flags.seed, flags.seed) : range_of(flags.seeds);
  const auto begin = std::chrono::steady_clock::now();
  unsigned failed = 0;
  std::size_t answered = 0;
  Time virtual_time{};
  std::uint64_t runs = 0;
  for (std::uint64_t seed = first; seed <= last && failed < flags.most; ++seed) {
    Options options;
    options.bug = bug_of(flags.bug);
    if (flags.trace) {
      options.trace = [](const std::string& line) { fmt::print("{}\n", line); };
    }
    World world(seed, options);
    const Outcome outcome = world.run();
    ++runs;
    answered += outcome.answered;
    virtual_time += outcome.took;
    if (!outcome.violations.empty()) {
      ++failed;
      fmt::print("seed {}: {}\n  replay: millrace-simulation --seed {} --trace{}\n", seed,
                 fmt::join(outcome.violations, "\n  "), seed,
                 flags.bug.empty() ? "" : " --bug " + flags.bug);
      std::fflush(stdout);
    }
  }
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  fmt::print("{} seeds, {} failed; {} calls answered in {:.0f} virtual seconds, {:.1f} real ones\n",
             runs, failed, answered, std::chrono::duration<double>(virtual_time).count(),
             took.count());
  return failed == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Simulates plants with gateways and services in virtual time, with faults."};
  Flags flags;
  app.add_option("--seeds", flags.seeds, "FIRST..LAST: which simulations to run");
  app.add_option("--seed", flags.seed, "One simulation");
  app.add_flag("--trace", flags.trace, "Print what happens");
  app.add_option("--bug", flags.bug, "A mistake to make on purpose (docs/simulation.md)");
  app.add_option("--most", flags.most, "Stop after so many failures");
  CLI11_PARSE(app, argc, argv);
  return run(flags);
}
