// An answer is interrupted at each of its steps, on each kind of kernel: the program gets it once.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gateway/channel_fixture.hpp"

namespace millrace::gateway {
namespace {

using testing::Combine;
using namespace std::chrono_literals;

struct Setting {
  tests::KernelRules kernel;
  bool with_interim = false;
};

class InterruptedAnswer : public testing::TestWithParam<std::tuple<bool, bool, bool>> {
 protected:
  static Setting setting() {
    const auto [auto_clear, ads_clears, with_interim] = GetParam();
    return {{auto_clear, ads_clears}, with_interim};
  }

  static std::ptrdiff_t releases(const ChannelFixture& fixture) {
    return std::ranges::count(fixture.writes, "RESPONSE_STATE=1");
  }

  /// The service: answers each call that is dispatched to it, and repeats the answer when requested
  /// again.
  static void serve(ChannelFixture& fixture) {
    if (fixture.sut->call() != nullptr && !fixture.sut->call()->answer) {
      fixture.sut->on_reply(fixture.reply("1.414", 1), fixture.now);
      fixture.settle();
    }
  }

  static void begin(ChannelFixture& fixture) {
    fixture.dispatched_call();
    if (setting().with_interim) {
      fixture.sut->on_reply(fixture.interim("half way", 5), fixture.now);
      fixture.settle();
    }
  }

  static void expect_answered_once(const ChannelFixture& fixture) {
    EXPECT_EQ(fixture.channel.values().response_state, 1U);
    EXPECT_EQ(fixture.channel.values().response, "1.414");
    EXPECT_EQ(fixture.channel.values().request_state, 0U);
    EXPECT_EQ(releases(fixture), 1);
    EXPECT_EQ(fixture.writes.back(), "RESPONSE_STATE=1");
    EXPECT_TRUE(fixture.journal_state.open_calls().empty());
  }
};

TEST_P(InterruptedAnswer, IsFinishedAfterAWriteOfUnknownOutcome) {
  for (const WriteResult write_result :
       {WriteResult{WriteOutcome::unknown, true}, WriteResult{WriteOutcome::unknown, false},
        WriteResult{WriteOutcome::refused, false}}) {
    for (int failing = 0; failing < 6; ++failing) {
      SCOPED_TRACE(fmt::format("write {}, executed {}", failing, write_result.executed));
      ChannelFixture fixture(setting().kernel);
      int count = 0;
      fixture.write_result = [&] { return count++ == failing ? write_result : WriteResult{}; };
      begin(fixture);
      fixture.wait(2s);
      serve(fixture);
      fixture.wait(2s);
      expect_answered_once(fixture);
    }
  }
}

TEST_P(InterruptedAnswer, IsFinishedAfterACrashOfTheGatewayAtAnyPoint) {
  bool finished_undisturbed = false;
  for (int crash = 1; !finished_undisturbed; ++crash) {
    SCOPED_TRACE(fmt::format("crash before action {}", crash));
    ChannelFixture fixture(setting().kernel);
    fixture.link_up();
    fixture.call();
    int actions = 0;
    fixture.before_action = [&] { fixture.stop = fixture.stop || ++actions == crash; };
    fixture.wait(20ms);
    fixture.sut->assign(fixture.assignment(), fixture.now);
    fixture.settle();
    if (setting().with_interim) {
      fixture.sut->on_reply(fixture.interim("half way", 5), fixture.now);
      fixture.settle();
    }
    serve(fixture);
    finished_undisturbed = !fixture.stop;
    fixture.before_action = [] {};
    fixture.restart();
    fixture.link_up();
    fixture.wait(20ms);
    if (fixture.sut->call() != nullptr && !fixture.sut->call()->answer) {
      fixture.sut->assign(fixture.assignment(), fixture.now);
      fixture.settle();
    }
    serve(fixture);
    fixture.wait(2s);
    expect_answered_once(fixture);
    ASSERT_LT(crash, 100);
  }
}

TEST_P(InterruptedAnswer, NeverOverwritesTheNextRequest) {
  bool finished_undisturbed = false;
  for (int crash = 1; !finished_undisturbed; ++crash) {
    SCOPED_TRACE(fmt::format("crash before action {}", crash));
    ChannelFixture fixture(setting().kernel);
    begin(fixture);
    int actions = 0;
    bool armed = true;
    fixture.before_action = [&] {
      // A quick program sends its next request as soon as it has its answer.
      if (fixture.channel.values().response_state == 1) {
        fixture.call("next", 2);
      }
      fixture.stop = fixture.stop || (armed && ++actions == crash);
    };
    serve(fixture);
    fixture.wait(20ms);
    finished_undisturbed = !fixture.stop;
    armed = false;
    fixture.restart();
    fixture.link_up();
    serve(fixture);
    fixture.wait(2s);
    EXPECT_EQ(fixture.channel.values().request_state, 2U);
    ASSERT_NE(fixture.sut->call(), nullptr);
    EXPECT_EQ(fixture.sut->call()->request.text, "next");
    EXPECT_EQ(releases(fixture), 1);
    ASSERT_LT(crash, 100);
  }
}

TEST_P(InterruptedAnswer, IsNotFinishedOnAControllerThatStartedAgain) {
  for (int crash = 1; crash < 12; ++crash) {
    SCOPED_TRACE(fmt::format("crash before action {}", crash));
    ChannelFixture fixture(setting().kernel);
    begin(fixture);
    int actions = 0;
    fixture.before_action = [&] { fixture.stop = fixture.stop || ++actions == crash; };
    serve(fixture);
    fixture.before_action = [] {};
    fixture.restart();
    fixture.channel.reset();
    const auto writes = fixture.writes.size();
    fixture.link_up();
    fixture.wait(2s);
    EXPECT_EQ(fixture.writes.size(), writes);
    EXPECT_EQ(fixture.sut->call(), nullptr);
  }
}

std::string kernel_name(const testing::TestParamInfo<std::tuple<bool, bool, bool>>& param) {
  const auto [auto_clear, ads_clears, with_interim] = param.param;
  return fmt::format("{}{}{}", auto_clear ? "AutoClear" : "NoAutoClear",
                     ads_clears ? "AdsClears" : "AdsKeeps", with_interim ? "Interim" : "");
}

INSTANTIATE_TEST_SUITE_P(Kernels, InterruptedAnswer,
                         Combine(testing::Bool(), testing::Bool(), testing::Bool()), kernel_name);

}  // namespace
}  // namespace millrace::gateway
