// When an answer has arrived, and what counts as a new request after it.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/channel/answer_writer.hpp"
#include "tests/unit/gateway/channel_fixture.hpp"

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;
using channel::AnswerWriter;
using channel::Released;
using Found = Released::Found;
using testing::Combine;

class AReleasedAnswer : public testing::Test {
 protected:
  /// RESPONSE_STATE = 1 was written and acknowledged; `zero_seen` if a read had shown REQUEST_STATE
  /// 0, or if 0 was `written` anyway. `interim` was the previous state.
  Released released(bool zero_seen, std::uint32_t interim = 0, bool written = false) {
    written = written || zero_seen;
    AnswerWriter writer(AnswerWriter::Kind::final, Response::of("1.4", 1).value());
    writer.set_clearing({.most = zero_seen ? 2U : 0U, .is_written = written});
    writer.on_read({ReadSet::request, request.uuid, "2", 1, interim, ""}, RequestStatus::pending,
                   request, {now, now});
    writer.on_written(now);
    writer.on_recorded(true);
    if (written) {
      writer.on_written(now);
    }
    const std::vector interims{interim};
    const ServiceSnapshot shown{ReadSet::all,        request.uuid, "2",
                                zero_seen ? 0U : 1U, interim,      "1.4"};
    writer.on_read(shown, compare(shown, request, interims), request, {now, now});
    EXPECT_EQ(writer.on_written(now), AnswerWriter::Step::done);
    return {request, writer};
  }
  Found read(Released& sut, std::uint32_t request_state, std::uint32_t response_state,
             const std::string& text = "2", const std::string& response = "1.4") {
    ServiceSnapshot snapshot{sut.reads(),   request.uuid,   text,
                             request_state, response_state, response};
    return sut.on_read(snapshot, {now, now});
  }

  SteadyTime now{1h};
  const PendingRequest request{"560aacbf-6335-44a9-895a-8b27f3ed5e47", "2", 1};
};

TEST_F(AReleasedAnswer, IsCompleteOnceAReadShowsItsState) {
  auto sut = released(true);
  EXPECT_EQ(read(sut, 0, 1), Found::idle);
}

TEST_F(AReleasedAnswer, IsFollowedByARequestAsSoonAsRequestStateIsNot0EvenIfItIsTheSame) {
  auto sut = released(true);
  EXPECT_EQ(read(sut, 1, 0), Found::request);
  EXPECT_EQ(read(sut, 1, 1), Found::request) << "the previous RESPONSE_STATE may be next to it";
}

// The state belongs to an interim answer that another gateway has written to the next request.
TEST_F(AReleasedAnswer, IsFollowedByARequestWhereAnotherStateStandsBesideOtherTextsForASecond) {
  auto sut = released(false);
  EXPECT_EQ(read(sut, 1, 1002, "3", "soon"), Found::nothing);
  EXPECT_EQ(read(sut, 1, 1002, "3", "soon"), Found::nothing);
  now += 1s;
  EXPECT_EQ(read(sut, 1, 1002, "3", "soon"), Found::request);
}

TEST_F(AReleasedAnswer, IsFollowedByNoRequestWhereOtherTextsStoodForLessThanASecondEachTime) {
  auto sut = released(false);
  EXPECT_EQ(read(sut, 1, 1002, "3", "soon"), Found::nothing);
  EXPECT_EQ(read(sut, 1, 1002, "3", "soon"), Found::nothing);
  now += 600ms;
  EXPECT_EQ(read(sut, 1, 0), Found::nothing);
  now += 500ms;
  EXPECT_EQ(read(sut, 1, 1002, "3", "soon"), Found::nothing);
}

TEST_F(AReleasedAnswer, IsWaitedForWhileItsStateIsNotVisible) {
  auto sut = released(true);
  EXPECT_EQ(read(sut, 0, 0), Found::nothing);
  EXPECT_EQ(sut.reads(), ReadSet::all) << "the texts show whether the program has continued";
  EXPECT_EQ(read(sut, 0, 0), Found::nothing);
  EXPECT_EQ(sut.read_at(), now + 2ms);
  EXPECT_EQ(read(sut, 0, 0, "3"), Found::idle) << "it begins its next request";
}

TEST_F(AReleasedAnswer, IsWrittenAgainIfNoReadShowsItWithinASecond) {
  auto sut = released(true);
  read(sut, 0, 0);
  now += 999ms;
  EXPECT_EQ(read(sut, 0, 0), Found::nothing);
  now += 1ms;
  EXPECT_EQ(read(sut, 0, 0), Found::unreleased);
  EXPECT_TRUE(sut.problem().empty()) << "the program may have reset RESPONSE_STATE";
  sut.on_written(now);
  now += 2s;
  EXPECT_EQ(read(sut, 0, 0), Found::unreleased);
  EXPECT_FALSE(sut.problem().empty());
}

TEST_F(AReleasedAnswer, IsWrittenAgainAlsoWhereAnInterimStateStandsThereStill) {
  auto sut = released(true, 1001);
  EXPECT_EQ(read(sut, 0, 1001), Found::nothing);
  now += 1s;
  EXPECT_EQ(read(sut, 0, 1001), Found::unreleased);
  EXPECT_EQ(read(sut, 0, 7), Found::idle) << "another gateway has released the program";
  EXPECT_EQ(read(sut, 0, 1), Found::idle);
}

// A kernel has cleared REQUEST_STATE when the interim state was written, so we have not. A late
// release may be lost, but the program has set RESPONSE_STATE to 0. Found by the simulation.
TEST_F(AReleasedAnswer, IsOverWhenTheInterimStateReads0AndOnlyTheProgramCanHaveClearedIt) {
  AnswerWriter writer(AnswerWriter::Kind::final, Response::of("1.4", 1).value());
  ServiceSnapshot shown{ReadSet::request, request.uuid, "2", 0, 1001, ""};
  writer.on_read(shown, RequestStatus::pending, request, {now, now});
  writer.on_written(now);
  shown = {ReadSet::all, request.uuid, "2", 0, 1001, "1.4"};
  writer.on_read(shown, RequestStatus::pending, request, {now, now});
  ASSERT_EQ(writer.on_written(now), AnswerWriter::Step::done);
  ASSERT_FALSE(writer.may_be_cleared());
  Released sut(request, writer);

  EXPECT_EQ(read(sut, 0, 1001), Found::nothing);
  EXPECT_EQ(read(sut, 0, 0), Found::idle);
}

// A regression: the reads after the write forgot that the interim state had stood there, and the
// answer was released again to a program that had taken its request back. Found by the simulation.
TEST_F(AReleasedAnswer, IsOverWhenTheInterimStateReads0AlsoIfTheOutcomeOfItsReleaseIsUnknown) {
  AnswerWriter writer(AnswerWriter::Kind::final, Response::of("1.4", 1).value());
  const auto write = [&](const ServiceSnapshot& shown) {
    return writer.on_read(shown, compare(shown, request, std::vector<std::uint32_t>{1001}), request,
                          {now, now});
  };
  write({ReadSet::request, request.uuid, "2", 0, 1001, ""});
  writer.on_written(now);
  ASSERT_EQ(write({ReadSet::all, request.uuid, "2", 0, 1001, "1.4"}),
            AnswerWriter::Step::write_state);
  writer.on_unknown(now);
  const ServiceSnapshot withdrawn{ReadSet::all, request.uuid, "2", 0, 0, "1.4"};
  EXPECT_EQ(write(withdrawn), AnswerWriter::Step::read) << "its state may be shown later";
  now += 1s;
  ASSERT_EQ(write(withdrawn), AnswerWriter::Step::done);
  ASSERT_FALSE(writer.may_be_cleared());
  Released sut(request, writer);

  EXPECT_EQ(read(sut, 0, 0), Found::idle);
}

TEST_F(AReleasedAnswer, IsAwaitedWhereOurOwn0MayHaveClearedTheInterimState) {
  auto sut = released(true, 1001);
  EXPECT_EQ(read(sut, 0, 0), Found::nothing);
  now += 1s;
  EXPECT_EQ(read(sut, 0, 0), Found::unreleased);
}

TEST_F(AReleasedAnswer, OfAKernelThatClearsRequestStateIsOverWhenThatReads0) {
  auto sut = released(false);
  EXPECT_EQ(read(sut, 1, 1), Found::nothing) << "the old request";
  EXPECT_EQ(read(sut, 0, 1), Found::idle);
}

// A controller that shows 0 very late may be taken for such a kernel. Found by the simulation.
TEST_F(AReleasedAnswer, IsWrittenAgainBesideA0ThatMayBeItsOwn) {
  auto sut = released(false, 0, true);
  EXPECT_EQ(read(sut, 0, 0), Found::nothing);
  EXPECT_EQ(read(sut, 0, 0), Found::nothing) << "all five are read";
  now += 1s;
  EXPECT_EQ(read(sut, 0, 0), Found::unreleased);
}

TEST_F(AReleasedAnswer, OfSuchAKernelIsFollowedByARequestOfAnotherState) {
  auto sut = released(false);
  EXPECT_EQ(read(sut, 2, 0), Found::request);
}

TEST_F(AReleasedAnswer, OfSuchAKernelIsFollowedByTheSameRequestOnceItsStateWasReadAndIs0Again) {
  auto sut = released(false);
  EXPECT_EQ(read(sut, 1, 1), Found::nothing);
  EXPECT_EQ(read(sut, 1, 0), Found::request);
}

TEST_F(AReleasedAnswer, OfSuchAKernelIsNotMistakenForARequestBeforeItsStateWasRead) {
  auto sut = released(false);
  EXPECT_EQ(read(sut, 1, 0), Found::nothing);
  EXPECT_EQ(read(sut, 1, 0), Found::nothing);
  now += 999ms;
  EXPECT_EQ(read(sut, 1, 0), Found::nothing);
  now += 1ms;
  EXPECT_EQ(read(sut, 1, 0), Found::unreleased) << "no service runs twice for it";
}

TEST_F(AReleasedAnswer, OfSuchAKernelIsFollowedByOtherTextsThatStayForASecond) {
  auto sut = released(false);
  read(sut, 1, 0);
  EXPECT_EQ(read(sut, 1, 0, "3"), Found::nothing) << "they may be half written";
  now += 1s;
  EXPECT_EQ(read(sut, 1, 0, "3"), Found::request);
}

TEST_F(AReleasedAnswer, OfSuchAKernelIsNotWrittenAgainWhereItsTextHasGone) {
  auto sut = released(false);
  read(sut, 1, 0);
  now += 1s;
  EXPECT_EQ(read(sut, 1, 0, "2", ""), Found::nothing) << "as after a restart of the controller";
  now += 1s;
  EXPECT_EQ(read(sut, 1, 0, "2", ""), Found::request);
}

TEST_F(AReleasedAnswer, OfSuchAKernelBesideTheTextsOfTheNextRequestIsNoRequest) {
  auto sut = released(false);
  EXPECT_EQ(read(sut, 1, 1, "3"), Found::nothing);
}

// An answer is interrupted at each of its steps, on each kind of kernel: the program gets it once.

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
      fixture.receive(fixture.reply("1.414", 1));
    }
  }

  static void begin(ChannelFixture& fixture) {
    fixture.dispatched_call();
    if (setting().with_interim) {
      fixture.receive(fixture.interim("half way", 5));
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
    fixture.assign();
    if (setting().with_interim) {
      fixture.receive(fixture.interim("half way", 5));
    }
    serve(fixture);
    finished_undisturbed = !fixture.stop;
    fixture.before_action = [] {};
    fixture.restart();
    fixture.link_up();
    fixture.wait(20ms);
    if (fixture.sut->call() != nullptr && !fixture.sut->call()->answer) {
      fixture.assign();
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
