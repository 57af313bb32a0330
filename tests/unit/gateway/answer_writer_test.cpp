// The steps of an answer, and what a look at the channel says of a write of unknown outcome.
#include "gateway/channel/answer_writer.hpp"

#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

using Step = channel::AnswerWriter::Step;

class AnswerWriterTest : public testing::Test {
 protected:
  /// RESPONSE and REQUEST_STATE are written, and nobody knows whether RESPONSE_STATE is.
  AnswerWriterTest() {
    sut.on_look({ReadSet::request, request.uuid, "2", 1, 0, ""}, Standing::pending, request);
    sut.on_written();
    sut.on_recorded(true);
    sut.on_written();
    EXPECT_EQ(sut.on_unknown(), Step::look);
  }

  const PendingRequest request{"560aacbf-6335-44a9-895a-8b27f3ed5e47", "2", 1};
  /// As the gateway has left it, if its last write did not take place.
  const Snapshot unreleased{ReadSet::all, request.uuid, "2", 0, 0, "1.4"};
  channel::AnswerWriter sut{channel::AnswerWriter::Kind::final, Response::of("1.4", 1).value()};
};

TEST_F(AnswerWriterTest, ReleasesAProgramThatTwoLooksFindWaiting) {
  EXPECT_EQ(sut.on_look(unreleased, Standing::cleared, request), Step::look);
  EXPECT_EQ(sut.on_look(unreleased, Standing::cleared, request), Step::write_state);
}

// The program was released and asked anew, which clears RESPONSE_STATE, between two reads of one
// look; the answer was written once more, over its new request. Found by the simulation.
TEST_F(AnswerWriterTest, DoesNotReleaseAProgramThatAskedAnewDuringALook) {
  sut.on_look(unreleased, Standing::cleared, request);
  const Snapshot asks_anew{ReadSet::all, request.uuid, "3", 2, 0, "1.4"};
  EXPECT_EQ(sut.on_look(asks_anew, Standing::replaced, request), Step::done);
}

TEST_F(AnswerWriterTest, IsDoneIfTheProgramIsReleased) {
  const Snapshot released{ReadSet::all, request.uuid, "2", 0, 1, "1.4"};
  EXPECT_EQ(sut.on_look(released, Standing::answered, request), Step::done);
}

/// The program waits for RESPONSE alone, so that it is the last of the writes.
class TextLast : public testing::Test {
 protected:
  static channel::AnswerWriter writer(std::uint32_t state) {
    return {channel::AnswerWriter::Kind::final,
            Response::of("1.4", state, fabric::Awaited::response).value(),
            fabric::Awaited::response};
  }
  static channel::AnswerWriter resumed(std::uint32_t state, bool clearing) {
    return channel::AnswerWriter::resumed(
        Response::of("1.4", state, fabric::Awaited::response).value(), clearing,
        fabric::Awaited::response);
  }
  static Snapshot all(std::uint32_t request_state, std::uint32_t response_state,
                      const std::string& response, const std::string& text = "2") {
    return {ReadSet::all,   "560aacbf-6335-44a9-895a-8b27f3ed5e47",
            text,           request_state,
            response_state, response};
  }

  const PendingRequest request{"560aacbf-6335-44a9-895a-8b27f3ed5e47", "2", 1};
  const Snapshot pending{ReadSet::request, request.uuid, "2", 1, 0, ""};
  /// REQUEST_STATE is cleared, and the program, which has emptied RESPONSE before it asked, waits.
  const Snapshot waits = all(0, 0, "");
};

TEST_F(TextLast, ClearsTheRequestBeforeTheTextReleasesTheProgram) {
  auto sut = writer(0);
  EXPECT_EQ(sut.on_look(pending, Standing::pending, request), Step::record_clearing);
  EXPECT_EQ(sut.on_recorded(true), Step::clear);
  EXPECT_EQ(sut.on_written(), Step::write_response) << "RESPONSE_STATE is 0 already";
  EXPECT_EQ(sut.on_written(), Step::done);
}

TEST_F(TextLast, WritesAStateThatIsNot0BeforeTheText) {
  auto sut = writer(99);
  sut.on_look(pending, Standing::pending, request);
  sut.on_recorded(true);
  EXPECT_EQ(sut.on_written(), Step::write_state);
  EXPECT_EQ(sut.on_written(), Step::write_response);
  EXPECT_EQ(sut.on_written(), Step::done);
}

TEST_F(TextLast, WritesState0OverOneThatStoodThere) {
  auto sut = writer(0);
  sut.on_look({ReadSet::request, request.uuid, "2", 1, 7, ""}, Standing::pending, request);
  sut.on_recorded(true);
  EXPECT_EQ(sut.on_written(), Step::write_state);
}

TEST_F(TextLast, OfUnknownOutcomeIsWrittenAgainIfTwoLooksFindTheProgramWaiting) {
  auto sut = writer(0);
  sut.on_look(pending, Standing::pending, request);
  sut.on_recorded(true);
  sut.on_written();
  EXPECT_EQ(sut.on_unknown(), Step::look);
  EXPECT_EQ(sut.on_look(waits, Standing::cleared, request), Step::look);
  EXPECT_EQ(sut.on_look(waits, Standing::cleared, request), Step::write_response);
}

TEST_F(TextLast, IsNotWrittenAgainToAProgramThatBeginsItsNextRequest) {
  auto sut = writer(0);
  sut.on_look(pending, Standing::pending, request);
  sut.on_recorded(true);
  sut.on_written();
  sut.on_unknown();
  sut.on_look(waits, Standing::cleared, request);
  EXPECT_EQ(sut.on_look(all(0, 0, "", "3"), Standing::cleared, request), Step::dropped);
}

TEST_F(TextLast, OfAnEarlierRunIsCompletedWhereTheJournalSaysThatTheRequestWasCleared) {
  auto sut = resumed(0, true);
  EXPECT_EQ(sut.on_look(all(0, 0, "1.4"), Standing::cleared, request), Step::done);
  sut = resumed(0, true);
  sut.on_look(waits, Standing::cleared, request);
  EXPECT_EQ(sut.on_look(waits, Standing::cleared, request), Step::write_response);
  sut = resumed(0, false);
  EXPECT_EQ(sut.on_look(waits, Standing::cleared, request), Step::dropped)
      << "the program has taken its request back";
}

TEST_F(TextLast, OfAnEarlierRunIsCompletedThatHadWrittenItsState) {
  auto sut = resumed(99, true);
  sut.on_look(all(0, 99, ""), Standing::answered, request);
  EXPECT_EQ(sut.on_look(all(0, 99, ""), Standing::answered, request), Step::write_response);
}

TEST_F(TextLast, IsDroppedWhereSomebodyElseHasAnswered) {
  auto sut = writer(99);
  EXPECT_EQ(
      sut.on_look({ReadSet::request, request.uuid, "2", 0, 5, ""}, Standing::answered, request),
      Step::dropped);
}

}  // namespace
}  // namespace millrace::gateway
