// The steps of an answer, and how a read of the channel proves its writes.
#include "gateway/channel/answer_writer.hpp"

#include <algorithm>
#include <array>

#include <gtest/gtest.h>

#include "gateway/service_snapshot.hpp"

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;
using channel::AnswerWriter;
using Step = AnswerWriter::Step;

class AnAnswer : public testing::Test {
 protected:
  static AnswerWriter writer(std::uint32_t state, fabric::CompletionSignal completion_signal) {
    return {AnswerWriter::Kind::final, Response::of("1.4", state, completion_signal).value(),
            completion_signal};
  }
  static AnswerWriter resumed(std::uint32_t state, bool clearing,
                              fabric::CompletionSignal completion_signal) {
    return AnswerWriter::resumed(Response::of("1.4", state, completion_signal).value(), clearing,
                                 completion_signal);
  }
  ServiceSnapshot all(std::uint32_t request_state, std::uint32_t response_state,
                      const std::string& response, const std::string& text = "2") {
    return {ReadSet::all, request.uuid, text, request_state, response_state, response};
  }
  Step read(AnswerWriter& sut, ServiceSnapshot snapshot) {
    // As in OpenCall::on_snapshot().
    zero_read = zero_read || snapshot.request_state == 0;
    const RequestStatus status = zero_read && snapshot.request_state != 0
                                     ? RequestStatus::replaced
                                     : compare(snapshot, request, {});
    if (sut.reads() == ReadSet::request) {
      snapshot.set = ReadSet::request;
      snapshot.response.clear();
    }
    return sut.on_read(snapshot, status, request, {now, now});
  }
  Step wait_and_read(AnswerWriter& sut, std::chrono::milliseconds time,
                     const ServiceSnapshot& snapshot) {
    now += time;
    return read(sut, snapshot);
  }

  bool zero_read = false;
  SteadyTime now{1h};
  const PendingRequest request{"560aacbf-6335-44a9-895a-8b27f3ed5e47", "2", 1};
  const ServiceSnapshot pending = all(1, 0, "");
};

/// RESPONSE and REQUEST_STATE = 0 are written and acknowledged.
class AWrittenAnswer : public AnAnswer {
 protected:
  AWrittenAnswer() {
    EXPECT_EQ(read(sut, pending), Step::write_response);
    EXPECT_EQ(sut.on_written(now), Step::record_clearing);
    EXPECT_EQ(sut.on_recorded(true), Step::clear);
    EXPECT_EQ(sut.on_written(now), Step::read);
  }
  /// RESPONSE_STATE was written with an unknown result.
  void release_with_unknown_outcome() {
    EXPECT_EQ(read(sut, shown), Step::write_state);
    EXPECT_EQ(sut.on_unknown(now), Step::read);
  }

  AnswerWriter sut = writer(1, fabric::CompletionSignal::response_state);
  /// Both writes are visible.
  const ServiceSnapshot shown = all(0, 0, "1.4");
};

TEST_F(AWrittenAnswer, ReleasesItsProgramOnceAReadShowsBothWrites) {
  EXPECT_EQ(read(sut, shown), Step::write_state);
  EXPECT_TRUE(sut.zero_seen());
  EXPECT_EQ(sut.on_written(now), Step::done);
}

TEST_F(AWrittenAnswer, WaitsWhileReadsShowNeither) {
  EXPECT_EQ(read(sut, pending), Step::read);
  EXPECT_EQ(sut.read_at(), now + 2ms);
  EXPECT_EQ(wait_and_read(sut, 60ms, pending), Step::read);
  EXPECT_EQ(sut.read_at(), now + 10ms);
  EXPECT_EQ(wait_and_read(sut, 10ms, shown), Step::write_state);
}

TEST_F(AnAnswer, IsReadSoonAfterItsLastWriteAlsoWhereTheJournalTookLongBeforeIt) {
  AnswerWriter sut = writer(1, fabric::CompletionSignal::response_state);
  read(sut, pending);
  sut.on_written(now);
  now += 100ms;
  ASSERT_EQ(sut.on_recorded(true), Step::clear);
  sut.on_written(now);
  EXPECT_EQ(read(sut, pending), Step::read);
  EXPECT_EQ(sut.read_at(), now + 2ms);
}

TEST_F(AWrittenAnswer, WaitsForItsTextIfTheClearedStateIsVisibleFirst) {
  EXPECT_EQ(read(sut, all(0, 0, "")), Step::read);
  EXPECT_EQ(read(sut, shown), Step::write_state);
}

TEST_F(AWrittenAnswer, WaitsForTheClearedStateIfItsTextIsVisibleFirst) {
  EXPECT_EQ(read(sut, all(1, 0, "1.4")), Step::read);
  EXPECT_EQ(read(sut, shown), Step::write_state);
}

TEST_F(AWrittenAnswer, WritesATextAgainThatNoReadShowsWithinASecondAndReportsIt) {
  EXPECT_EQ(wait_and_read(sut, 999ms, all(0, 0, "")), Step::read);
  EXPECT_EQ(sut.take_report(), std::nullopt);
  EXPECT_EQ(wait_and_read(sut, 1ms, all(0, 0, "")), Step::write_response);
  EXPECT_NE(sut.take_report(), std::nullopt);
  EXPECT_FALSE(sut.problem().empty());
  EXPECT_EQ(sut.on_written(now), Step::read);
  EXPECT_EQ(wait_and_read(sut, 1999ms, all(0, 0, "")), Step::read)
      << "after 2 s for the next repetition";
  EXPECT_EQ(wait_and_read(sut, 1ms, all(0, 0, "")), Step::write_response);
}

TEST_F(AWrittenAnswer, ClearsRequestStateAgainThatNoReadShowsAsZeroWithinASecond) {
  EXPECT_EQ(wait_and_read(sut, 999ms, all(1, 0, "1.4")), Step::read);
  EXPECT_EQ(wait_and_read(sut, 1ms, all(1, 0, "1.4")), Step::clear);
  EXPECT_EQ(sut.on_written(now), Step::read);
}

TEST_F(AWrittenAnswer, ReleasesItsProgramOnAControllerThatNeverShowsZeroAfterThreeSeconds) {
  ASSERT_EQ(wait_and_read(sut, 1s, all(1, 0, "1.4")), Step::clear);
  sut.on_written(now);
  EXPECT_EQ(wait_and_read(sut, 1999ms, all(1, 0, "1.4")), Step::read);
  EXPECT_EQ(wait_and_read(sut, 1ms, all(1, 0, "1.4")), Step::write_state);
  EXPECT_TRUE(sut.does_without_clearing());
  EXPECT_FALSE(sut.zero_seen());
  EXPECT_TRUE(sut.problem().empty()) << "the cause is known";
}

TEST_F(AWrittenAnswer, WaitsLongerForZeroOnAControllerThatHasShownItBefore) {
  sut.set_clearing({.most = 5});
  for (const auto pause : {1s, 2s, 4s, 8s}) {
    ASSERT_EQ(wait_and_read(sut, pause, all(1, 0, "1.4")), Step::clear);
    sut.on_written(now);
  }
  EXPECT_FALSE(sut.does_without_clearing());
  EXPECT_EQ(wait_and_read(sut, 15999ms, all(1, 0, "1.4")), Step::read);
  EXPECT_EQ(wait_and_read(sut, 1ms, all(1, 0, "1.4")), Step::write_state);
}

TEST_F(AWrittenAnswer, ReleasesItsProgramAtOnceOnAControllerThatIsKnownNeverToShowZero) {
  sut.set_clearing({.most = 0});
  EXPECT_EQ(read(sut, all(1, 0, "1.4")), Step::write_state);
}

TEST_F(AWrittenAnswer, ReleasesNoProgramThatWouldReadAnotherText) {
  sut.set_clearing({.most = 0});
  for (int second = 0; second < 100; ++second) {
    EXPECT_NE(wait_and_read(sut, 1s, all(1, 0, "old")), Step::write_state);
    if (sut.next() == Step::write_response) {
      sut.on_written(now);
    }
  }
}

TEST_F(AWrittenAnswer, IsDroppedIfTheProgramGaveUpAndRequestsTheSameAgain) {
  EXPECT_EQ(read(sut, all(0, 0, "")), Step::read);
  EXPECT_EQ(read(sut, all(1, 0, "")), Step::dropped);
}

TEST_F(AWrittenAnswer, IsDroppedIfTheProgramRequestsSomethingElse) {
  EXPECT_EQ(read(sut, all(1, 0, "1.4", "3")), Step::dropped);
}

TEST_F(AWrittenAnswer, IsDroppedIfTheTextsOfTheNextRequestAreThereAlready) {
  EXPECT_EQ(read(sut, all(0, 0, "1.4", "3")), Step::dropped);
}

TEST_F(AWrittenAnswer, ThatAnotherGatewayHasWrittenIdenticallyIsDone) {
  AnswerWriter again = writer(1, fabric::CompletionSignal::response_state);
  read(again, all(1, 1, ""));
  again.on_written(now);
  again.on_recorded(true);
  again.on_written(now);
  const ServiceSnapshot released = all(0, 1, "1.4");
  EXPECT_EQ(again.on_read(released, RequestStatus::pending, request, {now, now}), Step::done);
}

TEST_F(AWrittenAnswer, IsNotRepeatedForAReadThatBeganBeforeTheWriteWasLost) {
  now += 2s;
  const ServiceSnapshot old = all(1, 0, "");
  EXPECT_EQ(sut.on_read(old, RequestStatus::pending, request, {now - 1500ms, now}), Step::read)
      << "the gateway has stood still since the read";
}

// This gateway, or its controller, has stood still: the program may have continued since.
TEST_F(AWrittenAnswer, IsNotRepeatedForAReadThatTookLong) {
  const ServiceSnapshot without_text = all(0, 0, "");
  const auto read_that_takes = [&](std::chrono::milliseconds time) {
    const SteadyTime asked = now + 2s;
    return sut.on_read(without_text, compare(without_text, request, {}), request,
                       {asked, asked + time});
  };
  EXPECT_EQ(read_that_takes(251ms), Step::read);
  EXPECT_EQ(read_that_takes(250ms), Step::write_response);
}

TEST_F(AWrittenAnswer, IsReleasedAgainIfTwoReadsASecondLaterFindTheProgramWaiting) {
  release_with_unknown_outcome();
  EXPECT_EQ(wait_and_read(sut, 999ms, shown), Step::read);
  EXPECT_EQ(wait_and_read(sut, 1ms, shown), Step::read);
  EXPECT_LE(sut.read_at(), now) << "the second read follows at once";
  EXPECT_EQ(read(sut, shown), Step::write_state);
}

// The program was released and sent its next request, which clears RESPONSE_STATE, between two
// reads of one snapshot; the answer was written once more, over its new request. Found by the
// simulation.
TEST_F(AWrittenAnswer, IsNotReleasedAgainToAProgramThatMadeItsNextRequestDuringARead) {
  release_with_unknown_outcome();
  wait_and_read(sut, 1s, shown);
  EXPECT_EQ(read(sut, all(2, 0, "1.4", "3")), Step::done);
}

TEST_F(AWrittenAnswer, IsDoneIfTheProgramIsReleased) {
  release_with_unknown_outcome();
  EXPECT_EQ(read(sut, all(0, 1, "1.4")), Step::done);
}

TEST_F(AWrittenAnswer, IsDoneIfTheProgramRepeatsItsRequestAfterAnUnknownRelease) {
  release_with_unknown_outcome();
  EXPECT_EQ(read(sut, all(1, 0, "1.4")), Step::done);
}

TEST_F(AnAnswer, WaitsForAResponseOfUnknownOutcomeBeforeRequestStateIsCleared) {
  AnswerWriter sut = writer(1, fabric::CompletionSignal::response_state);
  ASSERT_EQ(read(sut, pending), Step::write_response);
  sut.on_unknown(now);
  EXPECT_EQ(read(sut, pending), Step::read);
  EXPECT_EQ(wait_and_read(sut, 1s, pending), Step::write_response) << "it is lost";
  sut.on_unknown(now);
  EXPECT_EQ(read(sut, all(1, 0, "1.4")), Step::record_clearing);
}

TEST_F(AnAnswer, IsWrittenFromTheBeginningOnANewLinkUnlessRequestStateWasCleared) {
  AnswerWriter sut = writer(1, fabric::CompletionSignal::response_state);
  read(sut, pending);
  sut.on_unknown(now);
  sut.on_link_up();
  EXPECT_EQ(read(sut, pending), Step::write_response);
}

// RESPONSE is the only write of this answer: written once more, it could answer the next request.
TEST_F(AnAnswer, ThatMayHaveReleasedItsProgramIsNotWrittenBlindlyOnANewLink) {
  AnswerWriter sut = writer(0, fabric::CompletionSignal::response);
  sut.set_clearing({.most = 0, .is_written = false});
  ASSERT_EQ(read(sut, pending), Step::record_clearing);
  ASSERT_EQ(sut.on_recorded(true), Step::read);
  ASSERT_EQ(read(sut, pending), Step::write_response);
  sut.on_unknown(now);
  sut.on_link_up();
  EXPECT_TRUE(sut.may_be_released());
  EXPECT_EQ(read(sut, pending), Step::read) << "it may be late";
}

TEST_F(AnAnswer, ToAKernelThatClearsRequestStateItselfIsWrittenWithoutClearingIt) {
  AnswerWriter sut = writer(1, fabric::CompletionSignal::response_state);
  sut.set_clearing({.most = 0, .is_written = false});
  EXPECT_EQ(read(sut, pending), Step::write_response);
  EXPECT_EQ(sut.on_written(now), Step::record_clearing);
  EXPECT_EQ(sut.on_recorded(true), Step::read);
  EXPECT_EQ(read(sut, all(1, 0, "")), Step::read) << "RESPONSE is not visible yet";
  EXPECT_EQ(read(sut, all(1, 0, "1.4")), Step::write_state);
  EXPECT_EQ(sut.on_written(now), Step::done);
}

// A 0 next to RESPONSE_STATE 0 was written by the kernel, after a release from which the program
// has continued, or by an NC reset.
TEST_F(AnAnswer,
       ToAKernelThatClearsRequestStateItselfIsNotReleasedOnceMoreWhereRequestStateIsZero) {
  AnswerWriter sut = writer(1, fabric::CompletionSignal::response_state);
  sut.set_clearing({.most = 0, .is_written = false});
  read(sut, pending);
  sut.on_written(now);
  sut.on_recorded(true);
  EXPECT_EQ(read(sut, all(1, 0, "1.4")), Step::write_state);
  sut.on_unknown(now);
  EXPECT_EQ(read(sut, all(1, 0, "1.4")), Step::read);
  EXPECT_EQ(wait_and_read(sut, 500ms, all(0, 0, "1.4")), Step::read) << "the kernel may be first";
  EXPECT_EQ(wait_and_read(sut, 500ms, all(0, 0, "1.4")), Step::done);
}

TEST_F(AnAnswer, OfAnEarlierRunThatWasNotBegunIsReleasedAlthoughItsResponseIsLate) {
  AnswerWriter sut = resumed(1, false, fabric::CompletionSignal::response_state);
  EXPECT_EQ(read(sut, all(1, 0, "another")), Step::write_response);
  EXPECT_EQ(sut.on_written(now), Step::record_clearing);
  EXPECT_EQ(sut.on_recorded(true), Step::clear);
  EXPECT_EQ(sut.on_written(now), Step::read);
  EXPECT_EQ(read(sut, all(0, 0, "another")), Step::read) << "RESPONSE is late";
  EXPECT_EQ(read(sut, all(0, 0, "1.4")), Step::write_state);
}

TEST_F(AnAnswer, OfAnEarlierRunToSuchAKernelIsNotReleasedWhereRequestStateIsZero) {
  AnswerWriter sut = resumed(1, true, fabric::CompletionSignal::response_state);
  sut.set_clearing({.most = 0, .is_written = false});
  EXPECT_EQ(read(sut, all(0, 0, "1.4")), Step::read);
  EXPECT_EQ(wait_and_read(sut, 1s, all(0, 0, "1.4")), Step::done);
}

TEST_F(AnAnswer, OfAnEarlierRunWaitsASecondForARequestStateThatMayBeClearedYet) {
  AnswerWriter sut = resumed(1, true, fabric::CompletionSignal::response_state);
  EXPECT_EQ(read(sut, all(1, 0, "1.4")), Step::read);
  EXPECT_EQ(wait_and_read(sut, 999ms, all(1, 0, "1.4")), Step::read);
  EXPECT_EQ(wait_and_read(sut, 1ms, all(1, 0, "1.4")), Step::clear);
}

TEST_F(AnAnswer, OfAnEarlierRunThatReadsShowAsWrittenIsDoneAlsoWhereRequestStateIsNotCleared) {
  AnswerWriter sut = resumed(1, true, fabric::CompletionSignal::response_state);
  EXPECT_EQ(read(sut, all(1, 1, "1.4")), Step::done);
  EXPECT_FALSE(sut.zero_seen());
}

TEST_F(AnAnswer, OfAnEarlierRunIsOverWhereRequestStateReads0WhileItsTextIsWrittenAgain) {
  AnswerWriter sut = resumed(1, true, fabric::CompletionSignal::response_state);
  EXPECT_EQ(read(sut, all(1, 0, "")), Step::read);
  EXPECT_EQ(wait_and_read(sut, 1s, all(1, 0, "")), Step::write_response);
  EXPECT_EQ(sut.on_written(now), Step::read);
  EXPECT_EQ(read(sut, all(0, 0, "")), Step::done) << "an NC reset";
  EXPECT_TRUE(sut.zero_seen()) << "the next REQUEST_STATE is another request";
}

TEST_F(AnAnswer, OfAnEarlierRunIsDroppedWhereResponseHasAnotherText) {
  AnswerWriter sut = resumed(1, true, fabric::CompletionSignal::response_state);
  EXPECT_EQ(read(sut, all(0, 0, "another")), Step::read) << "RESPONSE may be late";
  EXPECT_EQ(wait_and_read(sut, 1s, all(0, 0, "another")), Step::dropped);
}

class AnInterimAnswer : public AnAnswer {
 protected:
  AnswerWriter sut{AnswerWriter::Kind::interim, Response::of("half way", 5).value()};
};

TEST_F(AnInterimAnswer, ShowsItsTextBeforeItsState) {
  EXPECT_EQ(read(sut, pending), Step::write_response);
  EXPECT_EQ(sut.on_written(now), Step::read);
  EXPECT_EQ(read(sut, all(1, 0, "")), Step::read);
  EXPECT_EQ(read(sut, all(1, 0, "half way")), Step::write_state);
  EXPECT_EQ(sut.on_written(now), Step::done);
}

TEST_F(AnInterimAnswer, OfUnknownOutcomeMayBeVisibleAfterRequestStateWasClearedByTheKernel) {
  read(sut, pending);
  sut.on_written(now);
  read(sut, all(1, 0, "half way"));
  sut.on_unknown(now);
  EXPECT_EQ(read(sut, all(0, 0, "half way")), Step::read);
  EXPECT_EQ(wait_and_read(sut, 1s, all(0, 0, "half way")), Step::dropped);
}

/// The program waits for RESPONSE alone, so RESPONSE is written last.
class TextLast : public AnAnswer {
 protected:
  static AnswerWriter writer(std::uint32_t state) {
    return AnAnswer::writer(state, fabric::CompletionSignal::response);
  }
  static AnswerWriter resumed(std::uint32_t state, bool clearing) {
    return AnAnswer::resumed(state, clearing, fabric::CompletionSignal::response);
  }
  /// REQUEST_STATE is cleared, and the program, which has emptied RESPONSE before its request,
  /// waits.
  const ServiceSnapshot waits = all(0, 0, "");
};

TEST_F(TextLast, ShowsTheClearedRequestBeforeTheTextReleasesTheProgram) {
  auto sut = writer(0);
  EXPECT_EQ(read(sut, pending), Step::record_clearing);
  EXPECT_EQ(sut.on_recorded(true), Step::clear);
  EXPECT_EQ(sut.on_written(now), Step::read) << "RESPONSE_STATE is 0 already";
  EXPECT_EQ(read(sut, pending), Step::read) << "not visible yet";
  EXPECT_EQ(read(sut, waits), Step::write_response);
  EXPECT_EQ(sut.on_written(now), Step::done);
}

TEST_F(TextLast, ShowsAStateThatIsNot0BeforeTheText) {
  auto sut = writer(99);
  read(sut, pending);
  sut.on_recorded(true);
  EXPECT_EQ(sut.on_written(now), Step::read);
  EXPECT_EQ(read(sut, waits), Step::write_state);
  EXPECT_EQ(sut.on_written(now), Step::read);
  EXPECT_EQ(read(sut, waits), Step::read) << "not visible yet";
  EXPECT_EQ(read(sut, all(0, 99, "")), Step::write_response);
  EXPECT_EQ(sut.on_written(now), Step::done);
}

TEST_F(TextLast, WritesState0OverAPreviousState) {
  auto sut = writer(0);
  read(sut, all(1, 7, ""));
  sut.on_recorded(true);
  sut.on_written(now);
  const ServiceSnapshot cleared = all(0, 7, "");
  EXPECT_EQ(sut.on_read(cleared, RequestStatus::pending, request, {now, now}), Step::write_state);
}

TEST_F(TextLast, OfUnknownOutcomeIsWrittenAgainIfTwoReadsASecondLaterFindTheProgramWaiting) {
  auto sut = writer(0);
  read(sut, pending);
  sut.on_recorded(true);
  sut.on_written(now);
  read(sut, waits);
  EXPECT_EQ(sut.on_unknown(now), Step::read);
  EXPECT_EQ(wait_and_read(sut, 1s, waits), Step::read);
  EXPECT_EQ(read(sut, waits), Step::write_response);
}

TEST_F(TextLast, IsNotWrittenAgainToAProgramThatBeginsItsNextRequest) {
  auto sut = writer(0);
  read(sut, pending);
  sut.on_recorded(true);
  sut.on_written(now);
  read(sut, waits);
  sut.on_unknown(now);
  wait_and_read(sut, 1s, waits);
  EXPECT_EQ(read(sut, all(0, 0, "", "3")), Step::done);
}

TEST_F(TextLast, OfAnEarlierRunIsCompletedWhereTheJournalHasTheRequestAsCleared) {
  auto sut = resumed(0, true);
  EXPECT_EQ(read(sut, all(0, 0, "1.4")), Step::done);
  sut = resumed(0, true);
  read(sut, waits);
  wait_and_read(sut, 1s, waits);
  EXPECT_EQ(read(sut, waits), Step::write_response);
  sut = resumed(0, false);
  EXPECT_EQ(read(sut, waits), Step::dropped) << "the program has withdrawn its request";
}

TEST_F(TextLast, OfAnEarlierRunIsCompletedThatHadWrittenItsState) {
  auto sut = resumed(99, true);
  read(sut, all(0, 99, ""));
  wait_and_read(sut, 1s, all(0, 99, ""));
  EXPECT_EQ(read(sut, all(0, 99, "")), Step::write_response);
}

TEST_F(TextLast, IsDroppedWhereAnotherClientHasAnswered) {
  auto sut = writer(99);
  EXPECT_EQ(read(sut, all(0, 5, "")), Step::dropped);
}

const PendingRequest pending_request{"uuid", "text", 7};
constexpr std::array<std::uint32_t, 1> interim_5{5};
constexpr std::span<const std::uint32_t> none;

ServiceSnapshot whole(const std::string& uuid, const std::string& text, std::uint32_t request_state,
                      std::uint32_t response_state) {
  return {ReadSet::request, uuid, text, request_state, response_state, ""};
}

TEST(Compare, ReportsAnUnchangedRequestAsPending) {
  EXPECT_EQ(compare(whole("uuid", "text", 7, 0), pending_request, none), RequestStatus::pending);
}

TEST(Compare, ReportsTwoZeroStatesAsWithdrawn) {
  EXPECT_EQ(compare(whole("uuid", "text", 0, 0), pending_request, none), RequestStatus::withdrawn);
}

TEST(Compare, SeesANewStateAndNewTextsUnderTheSameState) {
  EXPECT_EQ(compare(whole("uuid", "text", 8, 0), pending_request, none), RequestStatus::replaced);
  EXPECT_EQ(compare(whole("uuid", "other", 7, 0), pending_request, none), RequestStatus::replaced);
  EXPECT_EQ(compare(whole("other", "text", 7, 0), pending_request, none), RequestStatus::replaced);
}

TEST(Compare, ComparesOnlyWhatWasRead) {
  EXPECT_EQ(compare({ReadSet::state, "", "", 7, 0, ""}, pending_request, none),
            RequestStatus::pending);
  EXPECT_EQ(compare({ReadSet::states, "", "", 7, 0, ""}, pending_request, none),
            RequestStatus::pending);
}

TEST(Compare, RecognisesACallByItsInterimStateWhereTheKernelClearedTheRequest) {
  EXPECT_EQ(compare(whole("uuid", "text", 0, 5), pending_request, interim_5),
            RequestStatus::pending);
  EXPECT_EQ(compare({ReadSet::states, "", "", 0, 5, ""}, pending_request, interim_5),
            RequestStatus::pending);
  EXPECT_EQ(compare(whole("uuid", "other", 0, 5), pending_request, interim_5),
            RequestStatus::answered);
}

TEST(Compare, DetectsAnAnswerOfAnotherClient) {
  EXPECT_EQ(compare(whole("uuid", "text", 0, 1), pending_request, none), RequestStatus::answered);
  EXPECT_EQ(compare(whole("uuid", "text", 0, 1), pending_request, interim_5),
            RequestStatus::answered);
}

// A regression: the texts of an abandoned request are still there when the next one's state is
// written. Found by the simulation.
TEST(Snapshot, ReadsTheStateOfARequestBeforeItsTexts) {
  for (const ReadSet set : {ReadSet::request, ReadSet::all}) {
    const auto order = variables_of(set);
    const auto state = std::ranges::find(order, Variable::request_state);
    EXPECT_LT(state, std::ranges::find(order, Variable::uuid));
    EXPECT_LT(state, std::ranges::find(order, Variable::request));
  }
}

// A new REQUEST_STATE may clear RESPONSE_STATE.
TEST(Snapshot, ReadsTheStateOfTheResponseBeforeThatOfTheRequest) {
  for (const ReadSet set : {ReadSet::states, ReadSet::request, ReadSet::all}) {
    const auto order = variables_of(set);
    EXPECT_LT(std::ranges::find(order, Variable::response_state),
              std::ranges::find(order, Variable::request_state));
  }
}

}  // namespace
}  // namespace millrace::gateway
