#include "tests/cluster/history/record_check.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::tests::cluster {
namespace {

using fabric::Event;
using fabric::EventKind;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::StartsWith;
using tools::recording::Entry;

Entry of(std::uint64_t call, EventKind kind, std::uint32_t attempt = 0, std::uint8_t instance = 0,
         const std::string& text = "") {
  Event event{.key = {"cnc", 1},
              .call = {.epoch = 1, .number = call},
              .attempt = attempt,
              .kind = kind,
              .text = text};
  event.instance.bytes.fill(instance);
  return {.sample = event};
}

using Recording = std::vector<Entry>;

TEST(TheRecording, OfACallThatMovedToAnotherInstanceHasNoViolation) {
  const Recording recording{of(7, EventKind::seen),
                            of(7, EventKind::dispatched, 1, 1),
                            of(7, EventKind::lost, 1, 1),
                            of(7, EventKind::dispatched, 2, 2),
                            of(7, EventKind::written, 2, 2, "x"),
                            of(8, EventKind::seen),
                            of(8, EventKind::withdrawn)};
  EXPECT_THAT(violations_recorded(recording, {}), IsEmpty());
}

TEST(TheRecording, ShowsASecondAnswer) {
  const Recording same{of(7, EventKind::written, 1, 1, "x"), of(7, EventKind::written, 1, 1, "x")};
  EXPECT_THAT(violations_recorded(same, {}), IsEmpty());
  const Recording other{of(7, EventKind::written, 1, 1, "x"), of(7, EventKind::written, 1, 1, "y")};
  EXPECT_THAT(violations_recorded(other, {}), ElementsAre(StartsWith("I1: call 1-7")));
}

TEST(TheRecording, ShowsAnAnswerThatIsWrittenOverAnotherCall) {
  const Recording recording{of(7, EventKind::seen), of(8, EventKind::seen),
                            of(7, EventKind::written, 1, 1, "x")};
  EXPECT_THAT(violations_recorded(recording, {"1-8"}), ElementsAre(StartsWith("I2: call 1-7")));
}

TEST(TheRecording, ShowsAnAnswerToAWithdrawnCall) {
  const Recording recording{of(7, EventKind::seen), of(7, EventKind::withdrawn),
                            of(7, EventKind::written, 1, 1, "x")};
  EXPECT_THAT(violations_recorded(recording, {}), ElementsAre(StartsWith("I3: call 1-7")));
}

TEST(TheRecording, ShowsACallThatDidNotEnd) {
  const Recording recording{of(7, EventKind::seen)};
  EXPECT_THAT(violations_recorded(recording, {}), ElementsAre(StartsWith("I5: call 1-7")));
  EXPECT_THAT(violations_recorded(recording, {"1-7"}), IsEmpty());
}

TEST(TheRecording, ShowsAnAttemptThatWasDispatchedToTwoInstances) {
  const Recording recording{of(7, EventKind::dispatched, 1, 1), of(7, EventKind::dispatched, 1, 2)};
  EXPECT_THAT(violations_recorded(recording, {}), ElementsAre(StartsWith("I9: attempt 1")));
}

}  // namespace
}  // namespace millrace::tests::cluster
