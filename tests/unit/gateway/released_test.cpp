// When an answer has arrived, and what counts as a new request after it.
#include "gateway/channel/released.hpp"

#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

using channel::AnswerWriter;
using channel::Released;
using Found = Released::Found;
using namespace std::chrono_literals;

class AReleasedAnswer : public testing::Test {
 protected:
  /// RESPONSE_STATE = 1 was written and acknowledged; `zero_seen` if a read had shown REQUEST_STATE
  /// 0, or if 0 was `written` anyway. `interim` was the previous state.
  Released released(bool zero_seen, std::uint32_t interim = 0, bool written = false) {
    written = written || zero_seen;
    AnswerWriter writer(AnswerWriter::Kind::final, Response::of("1.4", 1).value());
    writer.set_clearing({.is_shown = zero_seen, .is_written = written});
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

}  // namespace
}  // namespace millrace::gateway
