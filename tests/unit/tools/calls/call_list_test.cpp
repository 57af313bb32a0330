#include "tools/commands/calls/call_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::commands::calls {
namespace {

using recording::tests::at;
using recording::tests::one_call;
using namespace std::chrono_literals;

TEST(TheLastCalls, AreAssembledFromAllTheirSamples) {
  CallList sut(10);
  for (const recording::Entry& entry : one_call(1, 0)) {
    sut.add(entry);
  }
  ASSERT_EQ(sut.rows().size(), 1U);
  const CallRow row = sut.rows().front();
  EXPECT_EQ(row.state, "written");
  EXPECT_EQ(row.call.first(recording::Stage::seen)->text, "2");
  EXPECT_EQ(row.response->text, "1.414214");
  EXPECT_EQ(row.took, 7'100us);
}

TEST(TheLastCalls, AreKnownFromTheReplyWhereTheEventsAreMissing) {
  CallList sut(10);
  for (const recording::Entry& entry : one_call(1, 0)) {
    if (std::holds_alternative<fabric::Reply>(entry.sample)) {
      sut.add(entry);
    }
  }
  ASSERT_EQ(sut.rows().size(), 1U);
  const CallRow row = sut.rows().front();
  EXPECT_EQ(row.state, "answered");
  EXPECT_EQ(row.call.first(recording::Stage::seen), nullptr);
  EXPECT_EQ(row.response->text, "1.414214");
  EXPECT_EQ(row.took, 3'100us);
}

TEST(TheLastCalls, ShowTheLastStepOfACallThatIsUnderWay) {
  CallList sut(10);
  std::vector<recording::Entry> entries = one_call(1, 0);
  sut.add(entries[0]);
  EXPECT_EQ(sut.rows().front().state, "seen");
  sut.add(entries[1]);
  EXPECT_EQ(sut.rows().front().state, "dispatched");
  recording::Entry held = entries[2];
  std::get<fabric::Event>(held.sample).kind = fabric::EventKind::held;
  std::get<fabric::Event>(held.sample).at = at(500);
  sut.add(held);
  EXPECT_EQ(sut.rows().front().state, "held");
  EXPECT_EQ(sut.rows().front().at, at(500));
}

TEST(TheLastCalls, AreKnownFromTheStateOfTheirChannelWhereNothingElseIs) {
  CallList sut(10);
  sut.add({.sample = fabric::ChannelStatus{.key = {"cnc", 1},
                                           .state = fabric::ChannelState::running,
                                           .since = at(7),
                                           .call = {0x5f, 1},
                                           .attempt = 3,
                                           .uuid = recording::tests::square_root}});
  ASSERT_EQ(sut.rows().size(), 1U);
  const CallRow row = sut.rows().front();
  EXPECT_EQ(row.state, "running");
  EXPECT_EQ(row.attempt, 3U);
  EXPECT_EQ(row.uuid, recording::tests::square_root);
  EXPECT_EQ(row.at, at(7));
}

TEST(TheLastCalls, AreLimitedInNumberWithTheNewestLast) {
  CallList sut(2);
  for (int number = 1; number <= 3; ++number) {
    for (const recording::Entry& entry :
         one_call(static_cast<std::uint64_t>(number), number * 10)) {
      sut.add(entry);
    }
  }
  ASSERT_EQ(sut.rows().size(), 2U);
  EXPECT_EQ(sut.rows().front().call.id.number, 2U);
  EXPECT_EQ(sut.rows().back().call.id.number, 3U);
}

}  // namespace
}  // namespace millrace::tools::commands::calls
