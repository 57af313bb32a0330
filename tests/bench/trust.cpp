// The cost of trust: calls over the fabric, and joining it, without protection, with SIGN and with
// ENCRYPT.
//
//   trust [CALLS] [INSTANCES]
//
// For each protection, a square root in a separate process, called in turn by this process, which
// acts as a gateway with the role tester; each on its own domain, all in a network of the
// benchmark's own. Prints the medians and 99th percentiles of calls in microseconds, the time from
// the start of a service until it can be called, and the time until INSTANCES (100) that start
// together can. Exit code 1 if a goal is missed: the median of a call with SIGN at most 1.5 times,
// with ENCRYPT 1.7 times that without, a process joins in at most 100 ms more, all instances within
// 10 s.
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <fmt/format.h>

#include "fabric/dds/trust_watch.hpp"
#include "fabric/endpoints/call_endpoint.hpp"
#include "fabric/trust/folder.hpp"
#include "tests/bench/series.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/own_network.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/wait_for.hpp"

namespace {

using namespace millrace;
using namespace std::chrono_literals;
using bench::Clock;
using Milliseconds = std::chrono::duration<double, std::milli>;
using Flags = std::vector<std::string>;
namespace fs = std::filesystem;

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
constexpr auto allowed = 120s;
constexpr double most_joining_more = 100;
constexpr double most_for_all = 10'000;

void run(Flags command) {
  command.insert(command.begin(), tests::binary("millrace"));
  tests::Process process(std::move(command));
  if (process.wait(allowed) != 0) {
    throw std::runtime_error(process.error_output());
  }
}

/// The fabric under one protection, and its measurements.
class Row : public fabric::endpoints::CallEndpointListener {
 public:
  Row(std::string what, double goal, const fs::path& plant,
      std::optional<fabric::trust::Protection> protection)
      : what_(std::move(what)), goal_(goal), services_(flags(plant, protection)) {
    fabric::dds::ParticipantOptions options{.domain = domain_.number()};
    if (protection) {
      const auto now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
      const auto credentials = fabric::trust::read_folder(plant / "bench", *protection, now);
      if (!credentials) {
        throw std::runtime_error(credentials.error());
      }
      options.configuration = credentials->cyclone_configuration;
      options.trust = std::make_shared<const fabric::dds::Trust>(
          fabric::dds::Trust{.name = credentials->name,
                             .identity_partitions = credentials->identity_partitions,
                             .until = credentials->until});
    }
    participant_.emplace(options);
    end_.emplace(*participant_, context_.get_executor(), *this,
                 fabric::endpoints::CallEndpoint::Of::tool);
  }

  /// Starts one process and waits until it can be called.
  void join() {
    const auto start = Clock::now();
    processes_.emplace_back(services_);
    await(1);
    joins_.add(Clock::now() - start);
  }
  void leave() {
    for (tests::Process& process : processes_) {
      process.terminate();
    }
    for (tests::Process& process : processes_) {
      process.wait(allowed);
    }
    processes_.clear();
    await(0);
  }
  void join_all(std::size_t count) {
    const auto start = Clock::now();
    for (std::size_t i = 0; i < count; ++i) {
      processes_.emplace_back(services_);
    }
    await(count);
    all_ = Milliseconds(Clock::now() - start).count();
  }

  void call() {
    const fabric::InstanceId who = *ready_.begin();
    const auto now =
        std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now());
    const fabric::Request request{.key = {.machine = "bench", .channel = 1},
                                  .call = {.epoch = 1, .number = ++number_},
                                  .assigned = who,
                                  .uuid = uuid,
                                  .text = "2",
                                  .state = 1,
                                  .seen = now,
                                  .dispatched = now};
    const auto start = Clock::now();
    if (const auto published = end_->publish(request); !published) {
      throw std::runtime_error(published.error());
    }
    if (!tests::run_until(
            context_, [&] { return answered_ == number_; }, allowed)) {
      throw std::runtime_error(what_ + ": a call is not answered");
    }
    times_.add(Clock::now() - start);
    end_->withdraw(fabric::key_of(request));
  }
  void forget_calls() { times_ = {}; }

  /// Whether the goals are met.
  bool print(Row& unprotected) {
    const double ratio = times_.median() / unprotected.times_.median();
    const double more = (joins_.median() - unprotected.joins_.median()) / 1000;
    fmt::print(
        "{:<12} call: median {:.1f} us, 99 % {:.1f} us, {:.2f} x (goal {:.1f}); joins in "
        "{:.0f} ms, {:+.0f} ms (goal {:.0f}); all in {:.1f} s (goal {:.0f})\n",
        what_, times_.median(), times_.p99(), ratio, goal_, joins_.median() / 1000, more,
        most_joining_more, all_ / 1000, most_for_all / 1000);
    return ratio <= goal_ && more <= most_joining_more && all_ <= most_for_all;
  }

 private:
  Flags flags(const fs::path& plant, std::optional<fabric::trust::Protection> protection) {
    Flags command{tests::binary("millrace-square-root"), "--domain",
                  std::to_string(domain_.number()), "--log-level", "warn"};
    if (protection) {
      const bool sign = *protection == fabric::trust::Protection::sign;
      const fs::path file = plant / (what_ + ".textproto");
      std::ofstream(file) << fmt::format("trust {{ folder: \"{}\" protection: {} }}\n",
                                         (plant / "square-root").string(),
                                         sign ? "SIGN" : "ENCRYPT");
      command.insert(command.end(), {"--fabric-config", file.string()});
    }
    return command;
  }

  void on_instance_ready(const fabric::InstanceIdentity& instance) override {
    ready_.insert(instance.id);
  }
  void on_instance_changed(const fabric::InstanceIdentity&) override {}
  void on_instance_gone(const fabric::InstanceId& instance) override { ready_.erase(instance); }
  void on_reply(const fabric::Reply& reply) override {
    if (reply.kind == fabric::ReplyKind::final && reply.text == "1.414214") {
      answered_ = reply.call.number;
    }
  }
  void await(std::size_t count) {
    if (!tests::run_until(
            context_, [&] { return ready_.size() == count; }, allowed)) {
      throw std::runtime_error(
          fmt::format("{}: {} of {} instances are ready", what_, ready_.size(), count));
    }
  }

  std::string what_;
  double goal_;
  tests::Domain domain_;
  Flags services_;
  boost::asio::io_context context_;
  std::optional<fabric::dds::Participant> participant_;
  std::set<fabric::InstanceId> ready_;
  std::uint64_t number_ = 0;
  std::uint64_t answered_ = 0;
  bench::Series times_;
  bench::Series joins_;
  double all_ = 0;
  std::optional<fabric::endpoints::CallEndpoint> end_;
  std::vector<tests::Process> processes_;
};

int measure(std::size_t calls, std::size_t instances) {
  using fabric::trust::Protection;
  const tests::TemporaryFolder folder;
  const fs::path plant = folder.path() / "plant";
  run({"trust", "init", plant});
  run({"trust", "issue", plant, "square-root", "--role", "service", "--uuid", uuid});
  run({"trust", "issue", plant, "bench", "--role", "tester"});

  std::vector<std::unique_ptr<Row>> rows;
  rows.push_back(std::make_unique<Row>("unprotected", 1.0, plant, std::nullopt));
  rows.push_back(std::make_unique<Row>("SIGN", 1.5, plant, Protection::sign));
  rows.push_back(std::make_unique<Row>("ENCRYPT", 1.7, plant, Protection::encrypt));

  constexpr int joins = 11;
  for (int i = 0; i < joins; ++i) {
    for (const auto& row : rows) {
      row->join();
      row->leave();
    }
  }
  for (const auto& row : rows) {
    row->join();
  }
  for (std::size_t i = 0; i < calls + calls / 10; ++i) {
    if (i == calls / 10) {
      // The calls so far were the warm-up.
      for (const auto& row : rows) {
        row->forget_calls();
      }
    }
    for (const auto& row : rows) {
      row->call();
    }
  }
  for (const auto& row : rows) {
    row->leave();
  }
  for (const auto& row : rows) {
    row->join_all(instances);
    row->leave();
  }
  bool met = true;
  for (const auto& row : rows) {
    met = row->print(*rows.front()) && met;
  }
  return met ? EXIT_SUCCESS : EXIT_FAILURE;
}

}  // namespace

int main(int argc, char** argv) {
  if (const std::string obstacle = tests::enter_own_network(); !obstacle.empty()) {
    fmt::print(stderr, "trust: {}\n", obstacle);
    return EXIT_FAILURE;
  }
  constexpr std::size_t usual_calls = 20'000;
  constexpr std::size_t usual_instances = 100;
  try {
    return measure(argc > 1 ? std::stoul(argv[1]) : usual_calls,
                   argc > 2 ? std::stoul(argv[2]) : usual_instances);
  } catch (const std::exception& error) {
    fmt::print(stderr, "trust: {}\n", error.what());
    return EXIT_FAILURE;
  }
}
