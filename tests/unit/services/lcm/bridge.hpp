// The bridge, an LCM process that sends messages to it, and its actions.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>
#include <millrace/drain_t.hpp>
#include <millrace/request_t.hpp>
#include <millrace/withdrawal_t.hpp>

#include "services/lcm/bridge.hpp"
#include "tests/unit/services/lcm/messages.hpp"

namespace millrace::services::lcm {

using namespace std::chrono_literals;

template <typename Wanted>
std::vector<Wanted> all(const Actions& actions) {
  std::vector<Wanted> found;
  for (const Action& action : actions) {
    if (const auto* action_wanted = std::get_if<Wanted>(&action)) {
      found.push_back(*action_wanted);
    }
  }
  return found;
}

/// The only one of its kind.
template <typename Wanted>
Wanted only(const Actions& actions) {
  const auto found = all<Wanted>(actions);
  EXPECT_EQ(found.size(), 1U);
  return found.empty() ? Wanted{} : found.front();
}

template <typename Message>
std::vector<Message> sent(const Actions& actions, const std::string& channel) {
  std::vector<Message> found;
  for (const Publish& publish : all<Publish>(actions)) {
    if (publish.channel == channel) {
      found.push_back(fabric::lcm::decode<Message>(publish.bytes).value());
    }
  }
  return found;
}

inline std::string log_of(const Actions& actions) {
  std::string text;
  for (const LogLine& line : all<LogLine>(actions)) {
    text += line.text + "\n";
  }
  return text;
}

class BridgeTest : public testing::Test {
 protected:
  Actions present(const presence_t& message, Sender sender) {
    return sut->on_message("MILLRACE_PRESENCE", fabric::lcm::encode(message), sender, now);
  }
  /// The LCM process announces its presence with these calls.
  Actions present(const std::vector<std::string>& calls = {}) {
    presence_t message = tests::presence(microseconds());
    for (const std::string& id : calls) {
      message.calls.emplace_back();
      message.calls.back().id = id;
      message.calls.back().attempt = 1;
    }
    message.running = static_cast<std::int32_t>(calls.size());
    message.draining = draining ? 1 : 0;
    return present(message, there);
  }
  Actions answer(const reply_t& message, std::optional<Sender> sender = {}) {
    return sut->on_message("MILLRACE_REPLY." + tests::uuid, fabric::lcm::encode(message),
                           sender.value_or(there), now);
  }
  [[nodiscard]] fabric::Request request(std::uint64_t number, std::uint32_t attempt = 1) const {
    return {.key = {"cnc", 1},
            .call = {5, number},
            .attempt = attempt,
            .uuid = tests::uuid,
            .text = "Ma\xDF",
            .state = 7,
            .deadline = fabric::Time(3us)};
  }
  /// The name of the call on LCM.
  [[nodiscard]] std::string name(std::uint64_t number) const { return call_name(request(number)); }
  Actions give(std::uint64_t number, std::uint32_t attempt = 1) {
    return sut->on_call(registration, request(number, attempt), now.steady);
  }
  Actions withdraw(std::uint64_t number) {
    return sut->on_cancelled(registration, {5, number}, now.steady);
  }
  void pass(std::chrono::milliseconds time) {
    now.steady += time;
    now.wall += time;
  }
  /// The same with a call of on_time() in each tick; returns the last actions.
  Actions pass_in_ticks(std::chrono::milliseconds time) {
    Actions actions;
    for (auto passed = 0ms; passed < time; passed += Bridge::tick) {
      pass(std::min(Bridge::tick, time - passed));
      actions = sut->on_time(now.steady);
    }
    return actions;
  }
  [[nodiscard]] std::int64_t microseconds() const {
    return std::chrono::duration_cast<std::chrono::microseconds>(now.wall.time_since_epoch())
        .count();
  }
  static std::vector<request_t> requests(const Actions& actions) {
    return sent<request_t>(actions, "MILLRACE_REQUEST." + tests::uuid);
  }
  static std::vector<withdrawal_t> withdrawals(const Actions& actions) {
    return sent<withdrawal_t>(actions, "MILLRACE_WITHDRAWAL." + tests::uuid);
  }
  static std::vector<drain_t> drains(const Actions& actions) {
    return sent<drain_t>(actions, "MILLRACE_DRAIN." + tests::uuid);
  }

  const Sender there{0x7F000001, 4000};
  const Sender elsewhere{0x7F000001, 4001};
  fabric::Moment now{fabric::SteadyTime(1h), fabric::Time(48h)};
  bool draining = false;
  Rules rules;
  std::unique_ptr<Bridge> sut = std::make_unique<Bridge>(rules);
  Registration registration = 0;
};

/// With one LCM process that is present.
class BridgeWithProgram : public BridgeTest {
 protected:
  BridgeWithProgram() { registration = only<Register>(present()).number; }
};

}  // namespace millrace::services::lcm
