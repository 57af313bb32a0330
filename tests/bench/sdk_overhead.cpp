// What the service library adds to a call, and the cost of an idle service.
//
//   sdk_overhead [CALLS]
//
// Within one domain object a DDS write returns when its sample has arrived, so the times are upper
// bounds: they contain one write each. Prints medians and 99th percentiles in microseconds, memory
// and processor time of each service when idle; exit code 1 if a goal is missed.
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "base/program/log.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "services/sdk/service.hpp"
#include "tests/bench/process_use.hpp"
#include "tests/bench/series.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using namespace millrace;
using bench::Clock;

constexpr double goal_median = 20;
constexpr double goal_memory_mib = 16;
constexpr double goal_processor_percent = 1;
constexpr auto idle_time = std::chrono::seconds(5);
const std::string uuid = "weather";
const std::string batch_uuid = "2b1f6e0c-5d0b-4f0c-9a8e-6a1f0c8b7d11";

/// True if the goal is met.
bool print(const char* what, bench::Series& times) {
  fmt::print("{}: median {:.1f} us, 99 % {:.1f} us, goal {:.0f} us\n", what, times.median(),
             times.p99(), goal_median);
  return times.median() <= goal_median;
}

/// When the last reply arrived; the listener runs in the thread that writes the reply.
struct Arrival {
  std::atomic<std::uint64_t> count = 0;
  std::atomic<Clock::time_point> at{};

  static void note(dds_entity_t, void* self) {
    auto& arrival = *static_cast<Arrival*>(self);
    arrival.at = Clock::now();
    ++arrival.count;
    arrival.count.notify_one();
  }
};

bool measure_calls(std::uint64_t calls) {
  const tests::Domain domain;
  const fabric::dds::Participant participant({.domain = domain.number()});
  std::atomic<Clock::time_point> entered{};
  std::atomic<Clock::time_point> left{};
  const services::sdk::Service service(
      {.uuid = uuid, .name = "bench", .domain = domain.number()},
      [&](const services::sdk::Call&) -> services::sdk::Response {
        entered = Clock::now();
        left = Clock::now();
        return {.text = "2.000000"};
      },
      base::program::no_log());

  Arrival arrival;
  const fabric::dds::Listener listener(dds_create_listener(&arrival));
  dds_lset_data_available(listener.get(), &Arrival::note);
  const std::string partition = fabric::wire::service_partition("millrace", uuid);
  fabric::wire::Writer<fabric::Request> requests(
      participant, fabric::wire::request_partition("millrace", uuid, service.identity().id));
  fabric::wire::Reader<fabric::Reply> replies(participant, partition, fabric::wire::Keep::last,
                                              {.listener = listener.get()});

  bench::Series in;
  bench::Series out;
  fabric::Request request{.key = {.machine = "cnc", .channel = 1},
                          .assigned = service.identity().id,
                          .uuid = uuid,
                          .text = "4",
                          .state = 1};
  for (std::uint64_t number = 1; number <= calls; ++number) {
    request.call = {.epoch = 1, .number = number};
    const std::uint64_t before = arrival.count;
    const auto start = Clock::now();
    if (const auto written = requests.write(request); !written) {
      fmt::print(stderr, "sdk_overhead: {}\n", written.error());
      return false;
    }
    arrival.count.wait(before);
    in.add(entered.load() - start);
    out.add(arrival.at.load() - left.load());
    replies.take();
  }
  const bool in_met = print("request written to handler entered", in);
  return print("handler left to reply arrived", out) && in_met;
}

struct Idle {
  std::string program;
  std::vector<std::string> arguments{};
};

/// Every service with its default settings, idle.
bool measure_idle(const Idle& idle) {
  const tests::Domain domain;
  std::vector<std::string> command{tests::binary(idle.program), "--domain",
                                   std::to_string(domain.number())};
  command.insert(command.end(), idle.arguments.begin(), idle.arguments.end());
  tests::Process service(command);
  service.await("^ready: ");
  const double before = bench::processor_seconds(service.pid());
  std::this_thread::sleep_for(idle_time);
  const double used = bench::processor_seconds(service.pid()) - before;
  const double percent = 100 * used / std::chrono::duration<double>(idle_time).count();
  const double memory = bench::resident_mib(service.pid());
  fmt::print(
      "{} idle: {:.1f} MiB resident, goal {:.0f} MiB; {:.2f} % of a processor, goal {:.0f} %\n",
      idle.program, memory, goal_memory_mib, percent, goal_processor_percent);
  return memory <= goal_memory_mib && percent < goal_processor_percent;
}

bool measure_idle() {
  // Archive and spool go into the current folder.
  const tests::TemporaryFolder folder;
  std::filesystem::current_path(folder.path());
  std::ofstream("mail.textproto") << "server { host: 'localhost' } from: 'a@example.com'\n"
                                     "recipient { name: 'b' address: 'b@example.com' }\n"
                                     "template { name: 'done' to: 'b' subject: 'x' }\n";
  bool met = true;
  for (const Idle& idle : {Idle{"millrace-square-root"}, Idle{"millrace-dial-gauge"},
                           Idle{"millrace-batch", {"--exec", "/bin/true", "--uuid", batch_uuid}},
                           Idle{"millrace-archiver"}, Idle{"millrace-lcm"},
                           Idle{"millrace-mail", {"--config", "mail.textproto"}}}) {
    met = measure_idle(idle) && met;
  }
  std::filesystem::current_path("/");
  return met;
}

}  // namespace

int main(int argc, char** argv) {
  const std::uint64_t calls = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 10'000;
  if (calls == 0) {
    fmt::print(stderr, "usage: sdk_overhead [CALLS]\n");
    return 2;
  }
  const bool fast = measure_calls(calls);
  const bool small = measure_idle();
  return fast && small ? 0 : 1;
}
