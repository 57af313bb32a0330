// Controllers that apply writes 0 to 50 ms after acknowledging them, and kernels that clear
// REQUEST_STATE just as late and ignore writes of 0 over ADS: with and without notifications, with
// programs that send their next request at once, with changing states and with 1 only. Each request
// runs once and gets its own answer.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/null_sink.h>

#include "base/program/log.hpp"
#include "cnc/ads/server.hpp"
#include "cnc/ads/sum_commands.hpp"
#include "cnc/ads/symbols.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/service_variable.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/service_interface.hpp"

namespace millrace::tests::failures {
namespace ads = cnc::ads;
namespace variables = cnc::variables;
using ads::ErrorCode;
using gateway::Variable;

// A controller in place of the virtual CNC: one channel behind an ADS server, which acknowledges
// writes and applies them later, and may clear REQUEST_STATE itself. Its program sends its next
// request in the cycle in which it finds its answer.
//
//   LateController sut(executor, {.response_after = 5ms, …}, {.requests = 20});
//   … machine { port: sut.port() … }
//   sut.answers();                                     // as the program has read them

struct LateProgram {
  std::string uuid;
  /// The text of each is its number, from 1.
  std::uint32_t requests = 20;
  /// REQUEST_STATE goes 1, 2, 3, 1 …; otherwise it is always 1.
  bool changing_states = false;
};

/// Everything runs on the one executor.
class LateController final : private cnc::ads::Device {
 public:
  LateController(const boost::asio::any_io_executor& executor, KernelRules rules,
                 LateProgram program, bool notifies, const base::program::Log& log);

  [[nodiscard]] std::uint16_t port() const { return server_.tcp_port(); }
  [[nodiscard]] const std::vector<std::string>& answers() const { return answers_; }
  [[nodiscard]] bool done() const { return answers_.size() == program_.requests; }

 private:
  [[nodiscard]] bool has_port(std::uint16_t port) const override;
  cnc::ads::Result<cnc::ads::DeviceInfo> info(std::uint16_t port) override;
  cnc::ads::Result<cnc::ads::DeviceState> state(std::uint16_t port) override;
  cnc::ads::Result<void> write_control(std::uint16_t port, cnc::ads::DeviceState wanted,
                                       cnc::ads::BytesView data) override;
  cnc::ads::Result<cnc::ads::Bytes> read(std::uint16_t port, cnc::ads::Index index,
                                         std::uint32_t length) override;
  cnc::ads::Result<void> write(std::uint16_t port, cnc::ads::Index index,
                               cnc::ads::BytesView data) override;
  cnc::ads::Result<cnc::ads::Bytes> read_write(std::uint16_t port, cnc::ads::Index index,
                                               std::uint32_t length,
                                               cnc::ads::BytesView data) override;
  [[nodiscard]] cnc::ads::Bytes value_of(gateway::Variable variable);
  void ask();
  void run();

  LateProgram program_;
  bool notifies_;
  ServiceInterface channel_;
  std::vector<std::string> answers_;
  boost::asio::steady_timer cycle_;
  cnc::ads::SumCommands with_sums_{*this};
  cnc::ads::Server server_;
};

namespace {

constexpr std::uint32_t channel_1 = variables::decoder_group + 1;
constexpr std::chrono::milliseconds cycle{1};

/// "V.G.SERVICE.UUID", or the same as a symbol, "CH[1].V.G.SERVICE.UUID", with or without a NUL and
/// any bytes after it.
std::optional<Variable> named(ads::BytesView text) {
  std::string name(text.begin(), std::ranges::find(text, 0));
  const std::string prefix = "CH[1].";
  name = name.starts_with(prefix) ? name.substr(prefix.size()) : name;
  for (const Variable variable : variables::all_service_variables) {
    if (name_of(variable) == name) {
      return variable;
    }
  }
  return std::nullopt;
}

}  // namespace

LateController::LateController(const boost::asio::any_io_executor& executor, KernelRules rules,
                               LateProgram program, bool notifies, const base::program::Log& log)
    : program_(std::move(program)),
      notifies_(notifies),
      channel_(rules),
      cycle_(executor),
      server_(
          executor, with_sums_,
          [] {
            ads::ServerOptions options;
            options.tcp_port = 0;
            return options;
          }(),
          log) {
  channel_.advance(gateway::SteadyTime::clock::now());
  ask();
  run();
}

void LateController::ask() {
  const auto number = static_cast<std::uint32_t>(answers_.size() + 1);
  channel_.call(
      {program_.uuid, std::to_string(number), program_.changing_states ? 1 + number % 3 : 1});
}

void LateController::run() {
  channel_.advance(gateway::SteadyTime::clock::now());
  if (!done() && channel_.values().response_state != 0) {
    answers_.push_back(channel_.values().response);
    if (!done()) {
      ask();
    }
  }
  cycle_.expires_after(cycle);
  cycle_.async_wait([this](const boost::system::error_code& cancelled) {
    if (!cancelled) {
      run();
    }
  });
}

bool LateController::has_port(std::uint16_t port) const {
  return port == variables::sda_port;
}

ads::Result<ads::DeviceInfo> LateController::info(std::uint16_t /*port*/) {
  return ads::DeviceInfo{1, 0, 0, "late"};
}

ads::Result<ads::DeviceState> LateController::state(std::uint16_t /*port*/) {
  constexpr std::uint16_t run = 5;
  return ads::DeviceState{run, 0};
}

ads::Result<void> LateController::write_control(std::uint16_t /*port*/, ads::DeviceState /*wanted*/,
                                                ads::BytesView /*data*/) {
  return tl::unexpected(ErrorCode::service_not_supported);
}

ads::Bytes LateController::value_of(Variable variable) {
  channel_.advance(gateway::SteadyTime::clock::now());
  const gateway::ServiceSnapshot& values = channel_.values();
  const auto bytes = [&]() -> ads::Result<ads::Bytes> {
    switch (variable) {
      case Variable::uuid:
        return variables::encode_value(variable, values.uuid);
      case Variable::request:
        return variables::encode_value(variable, values.request);
      case Variable::request_state:
        return variables::encode_value(variable, values.request_state);
      case Variable::response_state:
        return variables::encode_value(variable, values.response_state);
      case Variable::response:
        break;
    }
    return variables::encode_value(Variable::response, values.response);
  };
  return bytes().value();
}

/// A handle is the number of its variable, from 1.
ads::Result<ads::Bytes> LateController::read(std::uint16_t /*port*/, ads::Index index,
                                             std::uint32_t /*length*/) {
  const std::size_t number = index.offset;
  if (!notifies_ || index.group != ads::symbol::value_by_handle || number == 0 ||
      number > variables::all_service_variables.size()) {
    return tl::unexpected(ErrorCode::invalid_group);
  }
  return value_of(variables::all_service_variables.at(number - 1));
}

ads::Result<void> LateController::write(std::uint16_t /*port*/, ads::Index index,
                                        ads::BytesView data) {
  if (index.group == ads::symbol::release_handle) {
    return {};
  }
  const auto variable = named(data);
  if (index.group != channel_1 || index.offset != variables::offset::write_by_name || !variable) {
    return tl::unexpected(ErrorCode::invalid_group);
  }
  const auto end = std::ranges::find(data, 0) - data.begin();
  const auto value =
      variables::decode_value(*variable, data.subspan(static_cast<std::size_t>(end) + 1));
  if (!value) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  channel_.advance(gateway::SteadyTime::clock::now());
  channel_.write(*variable, *value);
  return {};
}

ads::Result<ads::Bytes> LateController::read_write(std::uint16_t /*port*/, ads::Index index,
                                                   std::uint32_t /*length*/, ads::BytesView data) {
  const auto variable = named(data);
  if (index.group == channel_1 && index.offset == variables::offset::read_by_name && variable) {
    return value_of(*variable);
  }
  if (notifies_ && index.group == ads::symbol::handle_by_name && variable) {
    const auto number = std::ranges::find(variables::all_service_variables, *variable) -
                        variables::all_service_variables.begin();
    return ads::ByteWriter().u32(static_cast<std::uint32_t>(number + 1)).take();
  }
  return tl::unexpected(ErrorCode::invalid_group);
}

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
    for (const Machine& machine : machines_) {
      text += fmt::format(
          "machine {{ name: \"{}\" host: \"127.0.0.1\" port: {} net_id: \"127.0.0.1.1.1\" "
          "channel: 1 {} }}\n",
          machine.name, machine.controller->port(), machine.settings);
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
                                 [](const Machine& machine) { return machine.controller->done(); });
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
  for (const Machine& machine : machines_) {
    std::vector<std::string> expected;
    for (std::uint32_t number = 1; number <= requests; ++number) {
      expected.push_back(std::to_string(number));
    }
    EXPECT_EQ(machine.controller->answers(), expected) << machine.name;
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
