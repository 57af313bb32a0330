// A call scheduler, and requests to it, for its tests.
#pragma once

#include <chrono>
#include <cstdint>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/sdk/call_scheduler.hpp"

namespace millrace::services::sdk {

class CallSchedulerTest : public testing::Test {
 protected:
  inline static const fabric::Moment now{fabric::SteadyTime(std::chrono::seconds(1'000)),
                                         fabric::Time(std::chrono::seconds(1'000'000))};
  static fabric::Moment later(int milliseconds) {
    const std::chrono::milliseconds passed(milliseconds);
    return {now.steady + passed, now.wall + passed};
  }

  inline static const fabric::InstanceId self = fabric::InstanceId::random();
  inline static const Response answer{.text = "2.000000", .state = 1};

  static fabric::CallId call(std::uint64_t number) { return {.epoch = 1, .number = number}; }

  static fabric::Request request(std::uint64_t number, std::uint16_t channel = 1) {
    return {.key = {.machine = "cnc", .channel = channel},
            .call = call(number),
            .assigned = self,
            .may_wait = true};
  }
  static fabric::Request at_once(fabric::Request request) {
    request.may_wait = false;
    return request;
  }

  /// Call `number` of channel 1 from another gateway.
  static fabric::Request of_another_gateway(std::uint64_t number) {
    fabric::Request asked = request(number);
    asked.call.epoch = 2;
    return asked;
  }

  static fabric::RequestKey asked_by(std::uint64_t epoch, std::uint16_t channel = 1) {
    return {{.machine = "cnc", .channel = channel}, epoch, self};
  }

  static fabric::Request again(fabric::Request request, std::uint32_t attempt) {
    request.attempt = attempt;
    return request;
  }

  template <typename Kind>
  static std::vector<Kind> only(const Actions& actions) {
    std::vector<Kind> found;
    for (const Action& action : actions) {
      if (const auto* kind = std::get_if<Kind>(&action)) {
        found.push_back(*kind);
      }
    }
    return found;
  }

  std::size_t started(const fabric::Request& asked) {
    return only<Start>(sut.on_request(asked, now)).size();
  }
  fabric::Reply answered(std::uint64_t number, const Result& result) {
    const auto sent = only<Send>(sut.on_result(call(number), result, now));
    EXPECT_THAT(sent, testing::SizeIs(1));
    return sent.empty() ? fabric::Reply{} : sent.front().reply;
  }

  CallScheduler sut{{.instance = self}};
};

}  // namespace millrace::services::sdk
