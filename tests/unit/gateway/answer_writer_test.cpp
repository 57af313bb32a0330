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

}  // namespace
}  // namespace millrace::gateway
