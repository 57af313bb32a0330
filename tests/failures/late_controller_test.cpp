// Controllers that apply writes 0 to 50 ms after acknowledging them, and kernels that clear
// REQUEST_STATE just as late and ignore writes of 0 over ADS: with and without notifications, with
// programs that send their next request at once, with changing states and with 1 only. Each request
// runs once and gets its own answer.
#include "tests/failures/late_controller.hpp"

#include <fstream>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/null_sink.h>

#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::failures {
namespace {

using namespace std::chrono_literals;

/// The UUID of millrace-slow-service.
const std::string uuid = "c0ffee00-0000-4000-8000-000000000001";
constexpr std::uint32_t requests = 20;

struct Machine {
  std::string name;
  bool notifies = false;
  std::string settings;
  std::unique_ptr<LateController> controller;
};

/// The controllers run in a thread of their own; other threads read them once it has ended.
class LateControllers : public testing::Test {
 protected:
  void add(std::chrono::milliseconds delay, bool kernel_clears, bool configured, bool notifies,
           bool changing_states) {
    KernelRules rules;
    if (kernel_clears) {
      rules.kernel_clears_after = delay;
    } else {
      rules.response_after = rules.request_state_after = rules.response_state_after = delay;
    }
    Machine machine;
    machine.name = fmt::format(
        "{}-{}-{}-{}", kernel_clears ? (configured ? "told" : "clears") : "late", delay.count(),
        notifies ? "notifies" : "polled", changing_states ? "changing" : "same");
    machine.settings = configured ? "kernel_clears_request_state: true" : "";
    machine.controller = std::make_unique<LateController>(
        io_.get_executor(), rules, LateProgram{uuid, requests, changing_states}, notifies, log_);
    machines_.push_back(std::move(machine));
  }

  std::string configuration() const {
    std::string text;
    for (const Machine& one : machines_) {
      text += fmt::format(
          "machine {{ name: \"{}\" host: \"127.0.0.1\" port: {} net_id: \"127.0.0.1.1.1\" "
          "channel: 1 {} }}\n",
          one.name, one.controller->port(), one.settings);
    }
    return text;
  }

  /// Runs all controllers for as long as the thread lives.
  std::jthread running() {
    return std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        io_.run_for(10ms);
      }
    });
  }

  /// Until all programs have their answers.
  void run_until_done() {
    const auto end = std::chrono::steady_clock::now() + 60s;
    const auto done = [&] {
      return std::ranges::all_of(machines_,
                                 [](const Machine& one) { return one.controller->done(); });
    };
    while (!done() && std::chrono::steady_clock::now() < end) {
      io_.run_for(10ms);
    }
    // A program that has its answer may still get a late write.
    io_.run_for(200ms);
  }

  integration::Chain chain_;
  boost::asio::io_context io_;
  base::program::Log log_ =
      std::make_shared<spdlog::logger>("late", std::make_shared<spdlog::sinks::null_sink_st>());
  std::vector<Machine> machines_;
};

TEST_F(LateControllers, GetEachRequestRunOnceAndAnsweredWithItsOwnAnswer) {
  for (const auto delay : {0ms, 2ms, 5ms, 10ms, 20ms, 50ms}) {
    for (const bool notifies : {false, true}) {
      for (const bool changing : {false, true}) {
        add(delay, false, false, notifies, changing);
        add(delay, true, changing != notifies, notifies, changing);
      }
    }
  }
  Process service = chain_.slow_service({"--delivery", "at-most-once", "--concurrency", "64",
                                         "--texts", (chain_.folder() / "texts").string()});
  // The gateway reports that it is ready once its controllers answer.
  Process gateway = [&] {
    const std::jthread controllers = running();
    return chain_.configured_gateway(configuration());
  }();
  run_until_done();
  for (const Machine& one : machines_) {
    std::vector<std::string> expected;
    for (std::uint32_t number = 1; number <= requests; ++number) {
      expected.push_back(std::to_string(number));
    }
    EXPECT_EQ(one.controller->answers(), expected) << one.name;
  }
  std::size_t executions = 0;
  std::ifstream texts(chain_.folder() / "texts");
  for (std::string line; std::getline(texts, line);) {
    ++executions;
  }
  EXPECT_EQ(executions, machines_.size() * requests);
}

TEST_F(LateControllers, ThatDoNotShowAWriteAreReportedByTheDoctor) {
  add(1h, false, false, true, false);
  const Process service = chain_.slow_service();
  const std::jthread controllers = running();
  const Process gateway = chain_.configured_gateway(configuration());
  const std::string channel = machines_.front().name + "/1";
  std::string words;
  await("the doctor's word of " + channel, [&] {
    Process doctor = chain_.millrace({"doctor"});
    words = doctor.wait() == 0 ? "" : doctor.output();
    return words.find(channel + ": the controller acknowledged RESPONSE") != std::string::npos;
  });
  EXPECT_THAT(words, testing::HasSubstr("another ADS client writes V.G.SERVICE"));
}

}  // namespace
}  // namespace millrace::tests::failures
