// The time of a call of an LCM program through millrace-lcm, compared with that of a DDS service.
//
//   lcm_bridge [CALLS]
//
// Both are square roots in separate processes, called in turn by one caller in place of a gateway,
// in a network of the benchmark's own. Prints medians and 99th percentiles in microseconds; exit
// code 1 if the median through the bridge is more than twice that of the direct one.
#include <chrono>
#include <cstdlib>
#include <string>

#include <fmt/format.h>

#include "tests/bench/series.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/own_network.hpp"
#include "tests/support/process.hpp"

namespace {

using namespace millrace;
using bench::Clock;

constexpr double goal = 2;

struct Service {
  const char* what;
  std::string uuid;
  bench::Series times{};

  void call(tests::Caller& caller) {
    const fabric::Request request = caller.request(uuid, "2");
    const auto start = Clock::now();
    caller.publish(request);
    const fabric::Reply reply = caller.await_reply(request);
    times.add(Clock::now() - start);
    caller.withdraw(request);
    if (reply.text != "1.414214") {
      throw std::runtime_error(fmt::format("{} answered {:?}", what, reply.text));
    }
  }

  /// The median.
  double print() {
    fmt::print("{}: median {:.1f} us, 99 % {:.1f} us\n", what, times.median(), times.p99());
    return times.median();
  }
};

int measure(std::size_t calls) {
  const tests::Domain domain;
  const std::string number = std::to_string(domain.number());
  // Without a log line for each call.
  const tests::Process direct(
      {tests::binary("millrace-square-root"), "--domain", number, "--log-level", "warn"});
  const tests::Process bridge(
      {tests::binary("millrace-lcm"), "--domain", number, "--log-level", "warn"});
  const tests::Process program({MILLRACE_LCM_SQUARE_ROOT});
  tests::Caller caller(domain.number());
  Service dds{"direct, over DDS", "560aacbf-6335-44a9-895a-8b27f3ed5e47"};
  Service lcm{"through the bridge, over LCM", "6c1f3f0a-54a4-4a43-9b8d-2f3a8c1f7e51"};
  if (!caller.await_instance(dds.uuid) || !caller.await_instance(lcm.uuid)) {
    fmt::print(stderr, "lcm_bridge: the services were not found\n");
    return EXIT_FAILURE;
  }
  for (std::size_t i = 0; i < calls + calls / 10; ++i) {
    if (i == calls / 10) {
      // The calls so far were the warm-up.
      dds.times = {};
      lcm.times = {};
    }
    dds.call(caller);
    lcm.call(caller);
  }
  const double ratio = 1 / dds.print() * lcm.print();
  fmt::print("the bridge takes {:.2f} times as long, goal {:.0f}\n", ratio, goal);
  return ratio <= goal ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace

int main(int argc, char** argv) {
  if (const std::string obstacle = tests::enter_own_network(); !obstacle.empty()) {
    fmt::print(stderr, "lcm_bridge: {}\n", obstacle);
    return EXIT_FAILURE;
  }
  constexpr std::size_t usual = 20'000;
  try {
    return measure(argc > 1 ? std::stoul(argv[1]) : usual);
  } catch (const std::exception& error) {
    fmt::print(stderr, "lcm_bridge: {}\n", error.what());
    return EXIT_FAILURE;
  }
}
