// An answer that is interrupted at each of its steps, on each kind of kernel: the program gets it
// once.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gateway/desk.hpp"

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

  static std::ptrdiff_t releases(const Desk& desk) {
    return std::ranges::count(desk.writes, "RESPONSE_STATE=1");
  }

  /// What a service does: answers each call that is given to it, and repeats the answer when asked
  /// again.
  static void serve(Desk& desk) {
    if (desk.sut->call() != nullptr && !desk.sut->call()->answer) {
      desk.sut->on_reply(desk.reply("1.414", 1), desk.now);
      desk.settle();
    }
  }

  static void begin(Desk& desk) {
    desk.dispatched_call();
    if (setting().with_interim) {
      desk.sut->on_reply(desk.interim("half way", 5), desk.now);
      desk.settle();
    }
  }

  static void expect_answered_once(const Desk& desk) {
    EXPECT_EQ(desk.channel.values().response_state, 1U);
    EXPECT_EQ(desk.channel.values().response, "1.414");
    EXPECT_EQ(desk.channel.values().request_state, 0U);
    EXPECT_EQ(releases(desk), 1);
    EXPECT_EQ(desk.writes.back(), "RESPONSE_STATE=1");
    EXPECT_TRUE(desk.ledger.open_calls().empty());
  }
};

TEST_P(InterruptedAnswer, IsFinishedAfterAWriteOfUnknownOutcome) {
  for (const Fate fate : {Fate{WriteOutcome::unknown, true}, Fate{WriteOutcome::unknown, false},
                          Fate{WriteOutcome::refused, false}}) {
    for (int failing = 0; failing < 6; ++failing) {
      SCOPED_TRACE(fmt::format("write {}, executed {}", failing, fate.executed));
      Desk desk(setting().kernel);
      int count = 0;
      desk.fate = [&] { return count++ == failing ? fate : Fate{}; };
      begin(desk);
      desk.wait(2s);
      serve(desk);
      desk.wait(2s);
      expect_answered_once(desk);
    }
  }
}

TEST_P(InterruptedAnswer, IsFinishedAfterACrashOfTheGatewayAtAnyPoint) {
  bool finished_undisturbed = false;
  for (int crash = 1; !finished_undisturbed; ++crash) {
    SCOPED_TRACE(fmt::format("crash before action {}", crash));
    Desk desk(setting().kernel);
    desk.link_up();
    desk.call();
    int actions = 0;
    desk.before_action = [&] { desk.stop = desk.stop || ++actions == crash; };
    desk.wait(20ms);
    desk.sut->assign(desk.assignment(), desk.now);
    desk.settle();
    if (setting().with_interim) {
      desk.sut->on_reply(desk.interim("half way", 5), desk.now);
      desk.settle();
    }
    serve(desk);
    finished_undisturbed = !desk.stop;
    desk.before_action = [] {};
    desk.restart();
    desk.link_up();
    desk.wait(20ms);
    if (desk.sut->call() != nullptr && !desk.sut->call()->answer) {
      desk.sut->assign(desk.assignment(), desk.now);
      desk.settle();
    }
    serve(desk);
    desk.wait(2s);
    expect_answered_once(desk);
    ASSERT_LT(crash, 100);
  }
}

TEST_P(InterruptedAnswer, NeverWipesTheNextRequest) {
  bool finished_undisturbed = false;
  for (int crash = 1; !finished_undisturbed; ++crash) {
    SCOPED_TRACE(fmt::format("crash before action {}", crash));
    Desk desk(setting().kernel);
    begin(desk);
    int actions = 0;
    bool armed = true;
    desk.before_action = [&] {
      // A quick program asks again the moment it has its answer.
      if (desk.channel.values().response_state == 1) {
        desk.call("next", 2);
      }
      desk.stop = desk.stop || (armed && ++actions == crash);
    };
    serve(desk);
    desk.wait(20ms);
    finished_undisturbed = !desk.stop;
    armed = false;
    desk.restart();
    desk.link_up();
    serve(desk);
    desk.wait(2s);
    EXPECT_EQ(desk.channel.values().request_state, 2U);
    ASSERT_NE(desk.sut->call(), nullptr);
    EXPECT_EQ(desk.sut->call()->request.text, "next");
    EXPECT_EQ(releases(desk), 1);
    ASSERT_LT(crash, 100);
  }
}

TEST_P(InterruptedAnswer, IsNotFinishedOnAControllerThatStartedAgain) {
  for (int crash = 1; crash < 12; ++crash) {
    SCOPED_TRACE(fmt::format("crash before action {}", crash));
    Desk desk(setting().kernel);
    begin(desk);
    int actions = 0;
    desk.before_action = [&] { desk.stop = desk.stop || ++actions == crash; };
    serve(desk);
    desk.before_action = [] {};
    desk.restart();
    desk.channel.reset();
    const auto writes = desk.writes.size();
    desk.link_up();
    desk.wait(2s);
    EXPECT_EQ(desk.writes.size(), writes);
    EXPECT_EQ(desk.sut->call(), nullptr);
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
