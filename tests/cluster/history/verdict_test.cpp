#include "tests/cluster/history/verdict.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cluster/history/record_check.hpp"

namespace millrace::tests::cluster {
namespace {

using fabric::Event;
using fabric::EventKind;
using gateway::Answer;
using gateway::AnsweredEntry;
using gateway::DispatchedEntry;
using gateway::EndedEntry;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::StartsWith;
using tools::recording::Entry;

const fabric::CallId call{.epoch = 1, .number = 7};

DispatchedEntry dispatched(std::uint32_t attempt,
                           fabric::Delivery delivery = fabric::Delivery::at_least_once) {
  DispatchedEntry entry;
  entry.call = call;
  entry.delivery = delivery;
  entry.attempt = attempt;
  return entry;
}

AnsweredEntry answered(std::uint32_t attempt) {
  Answer answer;
  answer.attempt = attempt;
  return {call, answer};
}

Execution started(const std::string& service, std::uint32_t attempt) {
  return {Step::started, service, call.to_string(), attempt, "cnc/1"};
}

TEST(Verdict, IsEmptyForACallThatMovedToAnotherInstanceAndWasAnsweredOnce) {
  const History history{{dispatched(1), dispatched(2), answered(2), EndedEntry{call}},
                        {started("first", 1), started("second", 2)}};
  EXPECT_THAT(violations(history), IsEmpty());
}

// The gateway was killed before the event; the next one begins its journal without ended calls.
TEST(Verdict, CountsACallAsEndedThatAnEarlierGatewaysJournalHasAsEnded) {
  fabric::Event seen;
  seen.kind = fabric::EventKind::seen;
  seen.call = call;
  History history{{}, {}, {{.sample = seen}}};
  EXPECT_THAT(violations(history), ElementsAre(StartsWith("I5: call 1-7")));
  history.ended_before.insert(call.to_string());
  EXPECT_THAT(violations(history), IsEmpty());
}

TEST(Verdict, NamesACallThatWasAnsweredTwice) {
  const History history{{dispatched(1), answered(1), answered(1), EndedEntry{call}}, {}};
  EXPECT_THAT(violations(history), ElementsAre(StartsWith("I1: call 1-7")));
}

TEST(Verdict, NamesAnAnswerToAnAttemptThatWasNotDispatched) {
  const History history{{dispatched(1), answered(2), EndedEntry{call}}, {}};
  EXPECT_THAT(violations(history), ElementsAre(StartsWith("I2: call 1-7")));
}

TEST(Verdict, NamesAnAnswerWithStepsOutOfOrder) {
  using gateway::ClearingEntry;
  EXPECT_THAT(violations({{dispatched(1), answered(1), ClearingEntry{call}, EndedEntry{call}}, {}}),
              IsEmpty());
  EXPECT_THAT(violations({{dispatched(1), ClearingEntry{call}, answered(1), EndedEntry{call}}, {}}),
              ElementsAre(StartsWith("I3: the answer of call 1-7")));
  EXPECT_THAT(violations({{dispatched(1), EndedEntry{call}, answered(1)}, {}}),
              ElementsAre(StartsWith("I3: the answer of call 1-7")));
}

TEST(Verdict, ChecksTheRecordingToo) {
  History history{{dispatched(1), answered(1), EndedEntry{call}}, {}};
  fabric::Event event{.key = {"cnc", 1}, .call = call, .kind = fabric::EventKind::withdrawn};
  history.recording.push_back({.sample = event});
  event.kind = fabric::EventKind::written;
  history.recording.push_back({.sample = event});
  EXPECT_THAT(violations(history), ElementsAre(StartsWith("I3: call 1-7")));
}

TEST(Verdict, NamesAnAtMostOnceCallThatStartedTwice) {
  const History history{
      {dispatched(2, fabric::Delivery::at_most_once), answered(2), EndedEntry{call}},
      {started("first", 1), started("second", 2)}};
  EXPECT_THAT(violations(history), ElementsAre(StartsWith("I4: the handler of")));
}

TEST(Verdict, NamesACallThatHasNotEnded) {
  EXPECT_THAT(violations({{dispatched(1), answered(1)}, {}}),
              ElementsAre(StartsWith("I5: call 1-7")));
}

TEST(Verdict, NamesAnInstanceThatRanACallAgain) {
  const History history{{dispatched(2), answered(2), EndedEntry{call}},
                        {started("first", 1), started("first", 2)}};
  EXPECT_THAT(violations(history), ElementsAre(StartsWith("I9: first ran")));
}

TEST(Verdict, NamesAnAttemptThatTwoInstancesRan) {
  const History history{{dispatched(1), answered(1), EndedEntry{call}},
                        {started("first", 1), started("second", 1)}};
  EXPECT_THAT(violations(history), ElementsAre(StartsWith("I9: attempt 1")));
}

Entry of(std::uint64_t number, EventKind kind, std::uint32_t attempt = 0, std::uint8_t instance = 0,
         const std::string& text = "") {
  Event event{.key = {"cnc", 1},
              .call = {.epoch = 1, .number = number},
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

Entry of_gateway(std::uint8_t id) {
  fabric::MachineStatus status{.machine = "cnc", .connected = true};
  status.gateway.bytes.fill(id);
  return {.sample = status};
}

TEST(TheRecording, MayHaveNoEndOfACallThatAKilledGatewayHadNotDispatched) {
  const Recording seen{of_gateway(1), of(7, EventKind::seen), of_gateway(2)};
  EXPECT_THAT(violations_recorded(seen, {}), IsEmpty());
  const Recording dispatched{of_gateway(1), of(7, EventKind::seen),
                             of(7, EventKind::dispatched, 1, 1), of_gateway(2)};
  EXPECT_THAT(violations_recorded(dispatched, {}), ElementsAre(StartsWith("I5: call 1-7")));
  const Recording same{of_gateway(1), of(7, EventKind::seen), of_gateway(1)};
  EXPECT_THAT(violations_recorded(same, {}), ElementsAre(StartsWith("I5: call 1-7")));
}

TEST(TheRecording, ShowsAnAttemptThatWasDispatchedToTwoInstances) {
  const Recording recording{of(7, EventKind::dispatched, 1, 1), of(7, EventKind::dispatched, 1, 2)};
  EXPECT_THAT(violations_recorded(recording, {}), ElementsAre(StartsWith("I9: attempt 1")));
}

}  // namespace
}  // namespace millrace::tests::cluster
