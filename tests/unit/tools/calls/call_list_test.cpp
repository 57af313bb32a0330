#include "tools/commands/calls/call_list.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/commands/calls/board.hpp"

namespace millrace::tools::commands::calls {
namespace {

using namespace std::chrono_literals;
using recording::tests::at;
using recording::tests::one_call;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

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
  EXPECT_EQ(row.took, std::nullopt);
}

TEST(TheLastCalls, AreHeldWhereTheirChannelSaysSo) {
  CallList sut(10);
  fabric::ChannelStatus status{.key = {"cnc", 1}, .state = fabric::ChannelState::held};
  for (const recording::Entry& entry : one_call(1, 0)) {
    if (std::holds_alternative<fabric::Request>(entry.sample)) {
      sut.add(entry);
      status.call = std::get<fabric::Request>(entry.sample).call;
    }
  }
  EXPECT_EQ(sut.rows().front().state, "dispatched");
  status.since = at(50);
  sut.add({.sample = status});
  EXPECT_EQ(sut.rows().front().state, "held");
}

TEST(TheLastCalls, ShowTheStateOfTheirResponse) {
  CallList sut(10);
  for (recording::Entry& entry : one_call(1, 0)) {
    if (auto* const reply = std::get_if<fabric::Reply>(&entry.sample)) {
      reply->state = 99;
    }
    if (auto* const event = std::get_if<fabric::Event>(&entry.sample)) {
      event->state = event->kind == fabric::EventKind::written ? 99 : event->state;
    }
    sut.add(entry);
  }
  const std::string text = listing().text(sut.rows(), {}, at(100));
  EXPECT_THAT(text, ContainsRegex("answered .*\"2\" 1 +\"1.414214\" 99"));
}

TEST(TheLastCalls, AreLimitedInNumberWithTheNewestFirst) {
  CallList sut(2);
  for (int number = 1; number <= 3; ++number) {
    for (const recording::Entry& entry :
         one_call(static_cast<std::uint64_t>(number), number * 10)) {
      sut.add(entry);
    }
  }
  ASSERT_EQ(sut.rows().size(), 2U);
  EXPECT_EQ(sut.rows().front().call.id.number, 3U);
  EXPECT_EQ(sut.rows().back().call.id.number, 2U);
}

constexpr std::size_t wide = 200;

class TheBoard : public testing::Test {
 protected:
  void feed(const std::vector<recording::Entry>& entries) {
    for (const recording::Entry& entry : entries) {
      live.add(entry);
      if (const auto call = follower.add(entry)) {
        sut.add(*call, {}, entry.at);
      }
    }
  }

  Board sut;
  fabric::plant::Plant live;
  recording::CallFollower follower;
};

TEST_F(TheBoard, ShowsRateMeanAndLastResponseOfAChannel) {
  feed(one_call(17, 0));
  feed(one_call(18, 20));
  const std::string text = sut.text(live, follower, at(100), 24, wide);
  EXPECT_THAT(text, ContainsRegex("cnc/1 +- +2.0 +7.10 ms +2 +\"1.414214\" 1"));
  EXPECT_THAT(text, HasSubstr("5f-17"));
  EXPECT_THAT(text, HasSubstr("5f-18"));
}

TEST_F(TheBoard, ShowsChannelsWithoutCallsAndWhatIsPending) {
  live.add(
      {.sample = fabric::ChannelStatus{.key = {"cnc", 2}, .state = fabric::ChannelState::idle}});
  feed({one_call(17, 0)[0]});
  live.add(
      {.sample = fabric::ChannelStatus{.key = {"cnc", 1}, .state = fabric::ChannelState::running}});
  const std::string text = sut.text(live, follower, at(100), 24, wide);
  EXPECT_THAT(text, ContainsRegex("cnc/2 +idle"));
  EXPECT_THAT(text, ContainsRegex("cnc/1 +running .* \"2\"\n"));
}

TEST_F(TheBoard, FitsItsTerminal) {
  for (std::uint64_t i = 0; i < 100; ++i) {
    feed(one_call(i, static_cast<double>(i) * 20));
  }
  const std::string text = sut.text(live, follower, at(2000), 10, 40);
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 10);
  EXPECT_THAT(text, HasSubstr("CHANNEL"));
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = text.find('\n', from);
    EXPECT_LE(end - from, 40U);
    from = end + 1;
  }
  EXPECT_EQ(sut.text(live, follower, at(2000), 0, 40), "");
}

TEST_F(TheBoard, KeepsTheNewestCalls) {
  for (std::uint64_t i = 0; i < 1000; ++i) {
    feed(one_call(i, static_cast<double>(i) * 20));
  }
  const std::string text = sut.text(live, follower, at(20'000), 24, wide);
  EXPECT_THAT(text, HasSubstr("5f-999"));
  EXPECT_THAT(text, Not(HasSubstr("5f-900")));
}

}  // namespace
}  // namespace millrace::tools::commands::calls
