// The same service in C++, C and Python: times of its calls, and the cost of Python.
//
//   services [CALLS]             medians of 20,000 calls, start, import, calls per second
//   services --for SECONDS       100 calls per second of the service in Python; its memory
//
// The services answer the length of the text. One caller in place of a gateway calls them in turn.
// Exit code 1 if a goal is missed.
#include <array>
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "tests/bench/process_use.hpp"
#include "tests/bench/series.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using namespace millrace;
using bench::Clock;
using Seconds = std::chrono::duration<double>;

constexpr double goal_c = 1.1;
constexpr double goal_python = 3;
constexpr double goal_start_s = 0.5;
constexpr double goal_import_ms = 50;
constexpr double goal_calls = 4'000;
constexpr int starts = 11;
constexpr std::uint16_t concurrent = 16;

constexpr const char* python = "/usr/bin/python3";

double seconds_since(Clock::time_point start) {
  return Seconds(Clock::now() - start).count();
}

bool print(const std::string& what, double value, double goal, bool met) {
  fmt::print("{}: {:.3g}, goal {:g}{}\n", what, value, goal, met ? "" : ", missed");
  return met;
}

struct Service {
  const char* language;
  std::string uuid;
  tests::Process process;
  bench::Series times{};

  void call(tests::Caller& caller) {
    const fabric::Request request = caller.request(uuid, "hello");
    const auto start = Clock::now();
    caller.publish(request);
    const fabric::Reply reply = caller.await_reply(request);
    times.add(Clock::now() - start);
    caller.withdraw(request);
    if (reply.text != "5") {
      throw std::runtime_error(fmt::format("{} answered {:?}", language, reply.text));
    }
  }

  double print() {
    const double middle = times.median();
    fmt::print("{}: median {:.1f} us, 99 % {:.1f} us, {:.1f} MiB\n", language, middle, times.p99(),
               bench::resident_mib(process.pid()));
    return middle;
  }
};

/// Programs of one DDS domain, without a log line for each call.
class Bench {
 public:
  Bench() {
    ::setenv("MILLRACE_FABRIC_CONFIG", "", 1);
    ::setenv("MILLRACE_DOMAIN", std::to_string(domain_.number()).c_str(), 1);
    ::setenv("MILLRACE_LOG_LEVEL", "warn", 1);
    ::setenv("MILLRACE_LIBRARY", MILLRACE_C_LIBRARY, 1);
    ::setenv("PYTHONPATH", MILLRACE_SOURCE "/services/python", 1);
    // Byte code, as in an installed package.
    ::setenv("PYTHONPYCACHEPREFIX", byte_code_.path().c_str(), 1);
    ::unsetenv("PYTHONDONTWRITEBYTECODE");
  }

  Service in_cpp() {
    return start("C++", {MILLRACE_LENGTH_IN_CPP, "--log-level", "warn", "--uuid"});
  }
  Service in_c() { return start("C", {MILLRACE_LENGTH_IN_C, "unused"}); }
  Service in_python(std::uint16_t concurrency = 1) {
    return start("Python", {python, MILLRACE_SOURCE "/tests/bench/length.py", "--log-level", "warn",
                            "--concurrency", std::to_string(concurrency), "--uuid"});
  }

  /// Of a service in Python, from its start until it is ready.
  double start_time() {
    bench::Series times;
    for (int i = 0; i < starts; ++i) {
      const auto begin = Clock::now();
      const Service service = in_python();
      times.add(Clock::now() - begin);
    }
    return times.median() / 1e6;
  }

  static double import_time() {
    bench::Series times;
    for (int i = 0; i < starts; ++i) {
      tests::Process program({python, "-c",
                              "import time; t = time.perf_counter(); import millrace; "
                              "print(1e6 * (time.perf_counter() - t))"});
      program.wait();
      times.add_microseconds(std::stod(program.output()));
    }
    return times.median() / 1e3;
  }

  [[nodiscard]] tests::Caller caller() const { return tests::Caller(domain_.number()); }

 private:
  /// Its last argument is a UUID of its own.
  Service start(const char* language, std::vector<std::string> command) {
    std::string uuid = fmt::format("9d2c5f2e-1a70-4a1c-8a3e-{:012}", ++services_);
    command.push_back(uuid);
    Service service{language, std::move(uuid), tests::Process(std::move(command))};
    service.process.await("^ready: ");
    return service;
  }

  tests::Domain domain_;
  tests::TemporaryFolder byte_code_;
  int services_ = 0;
};

void expect(tests::Caller& caller, const Service& service) {
  if (!caller.await_instance(service.uuid)) {
    throw std::runtime_error(fmt::format("the service in {} was not found", service.language));
  }
}

bool measure_calls(Bench& bench, std::size_t calls) {
  std::array services{bench.in_cpp(), bench.in_c(), bench.in_python()};
  tests::Caller caller = bench.caller();
  for (const Service& service : services) {
    expect(caller, service);
  }
  for (std::size_t i = 0; i < calls + calls / 10; ++i) {
    for (Service& service : services) {
      if (i == calls / 10) {
        // The calls so far were the warm-up.
        service.times = {};
      }
      service.call(caller);
    }
  }
  const double cpp = services[0].print();
  const double c = services[1].print() / cpp;
  const double slower = services[2].print() / cpp;
  const bool c_met = print("C / C++", c, goal_c, c <= goal_c);
  return print("Python / C++", slower, goal_python, slower <= goal_python) && c_met;
}

/// Each channel makes its next call when the last one is answered.
bool measure_throughput(Bench& bench, std::size_t calls) {
  const Service service = bench.in_python(concurrent);
  tests::Caller caller = bench.caller();
  expect(caller, service);
  std::vector<fabric::Request> under_way;
  for (std::uint16_t channel = 1; channel <= concurrent; ++channel) {
    under_way.push_back(caller.request(service.uuid, "hello", channel));
    caller.publish(under_way.back());
  }
  const double before = bench::processor_seconds(service.process.pid());
  const auto start = Clock::now();
  fabric::Reply reply;
  for (std::size_t done = 0; done < calls;) {
    caller.await_reply(under_way[done % concurrent]);
    for (fabric::Request& request : under_way) {
      if (caller.poll_reply(request, reply)) {
        caller.forget_reply(request);
        request = caller.request(service.uuid, "hello", request.key.channel);
        caller.publish(request);
        ++done;
      }
    }
  }
  const double rate = static_cast<double>(calls) / seconds_since(start);
  const double used = bench::processor_seconds(service.process.pid()) - before;
  fmt::print("Python, {} calls at once: {:.1f} us of a processor per call\n", concurrent,
             1e6 * used / static_cast<double>(calls));
  return print("calls/s of one Python process", rate, goal_calls, rate >= goal_calls);
}

int measure(std::size_t calls) {
  Bench bench;
  bool met = measure_calls(bench, calls);
  met = measure_throughput(bench, calls) && met;
  const double start = bench.start_time();
  met = print("Python, start until ready, s", start, goal_start_s, start <= goal_start_s) && met;
  const double import = Bench::import_time();
  met = print("import millrace, ms", import, goal_import_ms, import <= goal_import_ms) && met;
  return met ? EXIT_SUCCESS : EXIT_FAILURE;
}

int measure_memory(Seconds time) {
  constexpr std::chrono::milliseconds period{10};
  constexpr std::size_t calls_per_line = 6'000;
  Bench bench;
  Service service = bench.in_python();
  tests::Caller caller = bench.caller();
  expect(caller, service);
  const auto start = Clock::now();
  for (std::size_t calls = 0;; ++calls) {
    const bool over = Clock::now() - start >= time;
    if (over || calls % calls_per_line == 0) {
      fmt::print("{:.0f} s, {} calls: {:.2f} MiB\n", seconds_since(start), calls,
                 bench::resident_mib(service.process.pid()));
      std::fflush(stdout);
    }
    if (over) {
      return EXIT_SUCCESS;
    }
    service.call(caller);
    service.times = {};
    std::this_thread::sleep_until(start + calls * period);
  }
}

}  // namespace

int main(int argc, char** argv) {
  constexpr std::size_t usual = 20'000;
  try {
    if (argc == 3 && argv[1] == std::string("--for")) {
      return measure_memory(Seconds(std::stod(argv[2])));
    }
    return measure(argc > 1 ? std::stoul(argv[1]) : usual);
  } catch (const std::exception& error) {
    fmt::print(stderr, "services: {}\n", error.what());
    return EXIT_FAILURE;
  }
}
