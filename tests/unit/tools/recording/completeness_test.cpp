#include "tools/recording/completeness.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::recording {
namespace {

using fabric::EventKind;
using tests::at;
using tests::one_call;

constexpr std::uint64_t epoch = 0x5f;
/// A time in which every sample has arrived.
constexpr double settled = 10'000;

fabric::InstanceId process(std::uint8_t number) {
  fabric::InstanceId id;
  id.bytes.fill(number);
  return id;
}

/// A gateway that joined at `since` ms.
Entry gateway(double since, std::uint8_t number = 1, std::uint64_t of_epoch = epoch) {
  return {
      .at = at(since),
      .sample = fabric::MachineStatus{
          .machine = "cnc", .gateway = process(number), .claimed = at(since), .epoch = of_epoch}};
}

Entry channel(double time, fabric::ChannelState state, fabric::CallId call = {}) {
  return {.at = at(time),
          .sample = fabric::ChannelStatus{.key = {"cnc", 1}, .state = state, .call = call}};
}

template <typename Sample>
Entry& the(std::vector<Entry>& entries) {
  return *std::ranges::find_if(
      entries, [](const Entry& entry) { return std::holds_alternative<Sample>(entry.sample); });
}

std::vector<Entry> in_channel(std::vector<Entry> entries, std::uint16_t number) {
  for (Entry& entry : entries) {
    std::visit(
        [&](auto& sample) {
          if constexpr (requires { sample.key; }) {
            sample.key.channel = number;
          }
        },
        entry.sample);
  }
  return entries;
}

std::vector<Entry> of_epoch(std::vector<Entry> entries, std::uint64_t other) {
  for (Entry& entry : entries) {
    std::visit(
        [&](auto& sample) {
          if constexpr (requires { sample.call; }) {
            sample.call.epoch = other;
          }
        },
        entry.sample);
  }
  return entries;
}

template <typename Sample>
std::vector<Entry> without(std::vector<Entry> entries) {
  std::erase_if(entries,
                [](const Entry& entry) { return std::holds_alternative<Sample>(entry.sample); });
  return entries;
}

std::vector<Entry> without(std::vector<Entry> entries, EventKind kind) {
  std::erase_if(entries, [&](const Entry& entry) {
    const auto* event = std::get_if<fabric::Event>(&entry.sample);
    return event != nullptr && event->kind == kind;
  });
  return entries;
}

class ACompleteness : public testing::Test {
 protected:
  void add(const std::vector<Entry>& entries, bool wanted = true) {
    for (const Entry& entry : entries) {
      sut.add(entry, wanted);
    }
  }
  Missing missing() {
    sut.finish(at(settled));
    return sut.missing();
  }

  Completeness sut;
};

TEST_F(ACompleteness, FindsACallCompleteOfWhichEverythingCame) {
  add({gateway(-1000)});
  add(one_call(17, 0));
  add(one_call(18, 20));
  EXPECT_EQ(missing(), (Missing{.complete = 2}));
}

TEST_F(ACompleteness, ReportsAMissingRequestThatAnEventImplies) {
  add({gateway(-1000)});
  add(without<fabric::Request>(one_call(17, 0)));
  EXPECT_EQ(missing(), (Missing{.incomplete = 1, .requests = 1}));
}

TEST_F(ACompleteness, ReportsAMissingReplyThatAnEventImplies) {
  add({gateway(-1000)});
  add(without<fabric::Reply>(one_call(17, 0)));
  EXPECT_EQ(missing(), (Missing{.incomplete = 1, .replies = 1}));
}

TEST_F(ACompleteness, ReportsAMissingInterimReplyThatWasWritten) {
  add({gateway(-1000)});
  auto entries = one_call(17, 0);
  Entry written = entries[2];
  auto& event = std::get<fabric::Event>(written.sample);
  event.kind = EventKind::interim;
  event.state = 50;
  entries.insert(entries.begin() + 3, written);
  add(entries);
  EXPECT_EQ(missing(), (Missing{.incomplete = 1, .replies = 1}));
}

TEST_F(ACompleteness, FindsAWrittenInterimReplyThatCame) {
  add({gateway(-1000)});
  auto entries = one_call(17, 0);
  Entry interim = the<fabric::Reply>(entries);
  auto& reply = std::get<fabric::Reply>(interim.sample);
  reply.kind = fabric::ReplyKind::interim;
  reply.state = 50;
  Entry written = entries[2];
  auto& event = std::get<fabric::Event>(written.sample);
  event.kind = EventKind::interim;
  event.state = 50;
  entries.insert(entries.begin() + 3, {interim, written});
  add(entries);
  EXPECT_EQ(missing(), (Missing{.complete = 1}));
}

TEST_F(ACompleteness, ReportsTheMissingEndOfACallOnceItsChannelHasAReplyToTheNext) {
  add({gateway(-1000)});
  add(without(one_call(17, 0), EventKind::written));
  auto next = one_call(18, 20);
  add({the<fabric::Reply>(next)});
  sut.finish(at(settled));
  EXPECT_EQ(sut.missing().incomplete, 1U);
  EXPECT_EQ(sut.missing().events, 1U);
}

TEST_F(ACompleteness, ReportsEachMissingEventThatOthersImply) {
  add({gateway(-1000)});
  add(one_call(16, -20));
  add(without(one_call(17, 0), EventKind::seen));
  add(without(one_call(18, 20), EventKind::dispatched));
  add(without(one_call(19, 40), EventKind::replied));
  add(without(one_call(20, 60), EventKind::written));
  add(one_call(21, 80));
  EXPECT_EQ(missing(), (Missing{.complete = 2, .incomplete = 4, .events = 4}));
}

TEST_F(ACompleteness, ReportsTheMissingEndOfTheLastCallOnceItsChannelIsIdle) {
  add({gateway(-1000)});
  add(without(one_call(17, 0), EventKind::written));
  add({channel(8, fabric::ChannelState::idle)});
  EXPECT_EQ(missing(), (Missing{.incomplete = 1, .events = 1}));
}

TEST_F(ACompleteness, CountsTheNumbersOfCallsOfWhichNothingCame) {
  add({gateway(-1000)});
  add(one_call(17, 0));
  add(one_call(20, 20));
  EXPECT_EQ(missing(), (Missing{.complete = 2, .unseen = 2}));
}

TEST_F(ACompleteness, CountsACallInAGapOnceEvenIfTheRestOfItComesLater) {
  add({gateway(-1000)});
  add(in_channel(one_call(16, -20), 2));
  const auto entries = without(one_call(17, 0), EventKind::seen);
  add({entries.begin(), entries.begin() + 2});
  // Call 18, in another channel, shows the gap long before 17 ends.
  add(in_channel(one_call(18, 2), 2));
  add(in_channel(one_call(19, 6000), 2));
  add({entries.begin() + 2, entries.end()});
  EXPECT_EQ(missing(), (Missing{.complete = 3, .incomplete = 1, .events = 1}));
}

TEST_F(ACompleteness, DoesNotCountACallThatIsUnderWay) {
  add({gateway(-1000)});
  auto entries = one_call(17, 0);
  entries.resize(3);
  add(entries);
  add({channel(3, fabric::ChannelState::running, {epoch, 17})});
  EXPECT_EQ(missing(), Missing{});
}

TEST_F(ACompleteness, DoesNotCountACallThatItsChannelShowsAgain) {
  add({gateway(-1000)});
  auto entries = one_call(17, 0);
  entries.resize(3);
  add(entries);
  add({channel(3, fabric::ChannelState::idle)});
  add({channel(5, fabric::ChannelState::running, {epoch, 17})});
  EXPECT_EQ(missing(), Missing{});
}

TEST_F(ACompleteness, IgnoresCallsThatBeganBeforeTheRecording) {
  add({gateway(-1000)});
  // 17 was seen before; 18 is the first complete call.
  add(without(one_call(17, 0), EventKind::seen));
  add(without<fabric::Reply>(without(one_call(16, 0), EventKind::seen)));
  add(one_call(18, 20));
  EXPECT_EQ(missing(), (Missing{.complete = 1}));
}

TEST_F(ACompleteness, IgnoresTheNumbersThatARestartedGatewaySkips) {
  add({gateway(-1000, 1)});
  add(one_call(17, 0));
  add({gateway(50, 2)});
  add(one_call(1001, 100));
  add(one_call(1003, 200));
  EXPECT_EQ(missing(), (Missing{.complete = 3, .unseen = 1}));
}

TEST_F(ACompleteness, DetectsARestartAlsoAfterItsFirstCall) {
  add({gateway(-1000, 1)});
  add(one_call(17, 0));
  add(one_call(1001, 100));
  Entry late = gateway(50, 2);
  late.at = at(150);
  add({late});
  EXPECT_EQ(missing(), (Missing{.complete = 2}));
}

TEST_F(ACompleteness, IgnoresAMachineThatAGatewayAddsWhileItRuns) {
  add({gateway(-1000, 1)});
  add(one_call(17, 0));
  add({gateway(10, 1)});
  add(one_call(19, 20));
  EXPECT_EQ(missing(), (Missing{.complete = 2, .unseen = 1}));
}

TEST_F(ACompleteness, FollowsTheCallThatAGatewayContinuesAfterARestart) {
  add({gateway(-1000, 1)});
  const auto entries = one_call(17, 0);
  add({entries.begin(), entries.begin() + 3});
  add({gateway(3, 2)});
  // It dispatches the same attempt again.
  add({entries[1], entries[2]});
  add({entries.begin() + 3, entries.end()});
  EXPECT_EQ(missing(), (Missing{.complete = 1}));
}

TEST_F(ACompleteness, ExpectsNoEndOfACallWhoseGatewayIsGone) {
  add({gateway(-1000)});
  auto entries = one_call(17, 0);
  entries.resize(3);
  add(entries);
  add({channel(500, fabric::ChannelState::link_down)});
  EXPECT_EQ(missing(), Missing{});
}

TEST_F(ACompleteness, ExpectsNoEndOfACallWhoseChannelAnotherGatewayTookOver) {
  add({gateway(-1000, 1), gateway(-900, 2, 0x60)});
  auto entries = one_call(17, 0);
  entries.resize(3);
  add(entries);
  add(of_epoch(one_call(3, 500), 0x60));
  EXPECT_EQ(missing(), (Missing{.complete = 1}));
}

TEST_F(ACompleteness, KeepsTwoGatewaysApart) {
  add({gateway(-1000, 1), gateway(-1000, 2, 0x60)});
  add(one_call(17, 0));
  add(in_channel(of_epoch(one_call(500, 1), 0x60), 2));
  add(one_call(18, 20));
  add(in_channel(of_epoch(one_call(502, 21), 0x60), 2));
  EXPECT_EQ(missing(), (Missing{.complete = 4, .unseen = 1}));
}

TEST_F(ACompleteness, LeavesOutWhatTheFilterExcludes) {
  add({gateway(-1000)});
  add(one_call(17, 0));
  add(without<fabric::Request>(one_call(18, 20)), false);
  add(one_call(19, 40), false);
  add(without<fabric::Request>(one_call(20, 60)));
  EXPECT_EQ(missing(), (Missing{.complete = 1, .incomplete = 1, .requests = 1}));
}

TEST_F(ACompleteness, LeavesCallsOfToolsOut) {
  add(without<fabric::Request>(one_call(1, 0)));
  add(without<fabric::Request>(one_call(7, 20)));
  EXPECT_EQ(missing(), Missing{});
}

TEST_F(ACompleteness, KeepsNothingOfCallsOfTools) {
  for (std::uint64_t number = 1; number <= 1000; ++number) {
    add(of_epoch(one_call(1, static_cast<double>(number) * 100), 0x100 + number));
  }
  EXPECT_LT(sut.open(), 30U);
}

TEST_F(ACompleteness, DetectsAGatewayAlsoAfterItsFirstCalls) {
  add(one_call(17, 0));
  add({gateway(10)});
  add(without<fabric::Reply>(one_call(18, 20)));
  EXPECT_EQ(missing(), (Missing{.complete = 1, .incomplete = 1, .replies = 1}));
}

TEST_F(ACompleteness, IgnoresTheOrderOfTopics) {
  add({gateway(-1000)});
  auto entries = one_call(17, 0);
  std::rotate(entries.begin(), entries.begin() + 3, entries.end());
  const auto next = one_call(18, 20);
  add({next[1], next[3]});
  add(entries);
  add({next[0], next[2], next[4], next[5], next[6]});
  EXPECT_EQ(missing(), (Missing{.complete = 2}));
}

TEST_F(ACompleteness, ChecksACallThatArrivesAfterTheNextOneOfItsChannel) {
  add({gateway(-1000)});
  add(one_call(16, -20));
  const auto next = one_call(18, 20);
  add({next[1], next[3]});
  // Its end is lost.
  add(without(one_call(17, 0), EventKind::written));
  add({next[0], next[2], next[4], next[5], next[6]});
  EXPECT_EQ(missing(), (Missing{.complete = 2, .incomplete = 1, .events = 1}));
}

TEST_F(ACompleteness, ExpectsNoReplyForAnOperatorsAnswer) {
  add({gateway(-1000)});
  auto entries = without<fabric::Reply>(one_call(17, 0));
  for (Entry& entry : entries) {
    auto* event = std::get_if<fabric::Event>(&entry.sample);
    if (event != nullptr && event->kind == EventKind::replied) {
      event->instance = {};
    }
  }
  add(entries);
  EXPECT_EQ(missing(), (Missing{.complete = 1}));
}

TEST_F(ACompleteness, ExpectsNoAnswerOfAWithdrawnCall) {
  add({gateway(-1000)});
  auto entries = without(without<fabric::Reply>(one_call(17, 0)), EventKind::replied);
  for (Entry& entry : entries) {
    auto* event = std::get_if<fabric::Event>(&entry.sample);
    if (event != nullptr && event->kind == EventKind::written) {
      event->kind = EventKind::withdrawn;
    }
  }
  add(entries);
  EXPECT_EQ(missing(), (Missing{.complete = 1}));
}

TEST_F(ACompleteness, ForgetsWhatIsChecked) {
  add({gateway(-1000)});
  for (std::uint64_t number = 1; number <= 1000; ++number) {
    add(one_call(number, static_cast<double>(number) * 100));
  }
  EXPECT_LT(sut.open(), 30U);
  // A service that rejoins sends its last answer again.
  auto entries = one_call(500, 200'000);
  add({the<fabric::Reply>(entries)});
  sut.finish(at(300'000));
  EXPECT_EQ(sut.missing(), (Missing{.complete = 1000}));
}

TEST_F(ACompleteness, ChecksWhatEndedJustBeforeItsOwnEnd) {
  add({gateway(-1000)});
  add(without<fabric::Reply>(one_call(17, 0)));
  sut.finish(at(10));
  EXPECT_EQ(sut.missing(), (Missing{.incomplete = 1, .replies = 1}));
}

TEST_F(ACompleteness, ToleratesAMissingEndWhenTheNextCallHasJustBegun) {
  add({gateway(-1000)});
  add(without(one_call(17, 0), EventKind::written));
  const auto next = one_call(18, 20);
  add({next[0], next[1]});
  sut.finish(at(30));
  EXPECT_EQ(sut.missing(), Missing{});
}

TEST_F(ACompleteness, CountsAGapJustBeforeItsOwnEnd) {
  add({gateway(-1000)});
  add(one_call(17, 0));
  add(one_call(20, 20));
  sut.finish(at(27.1 + 50));
  EXPECT_EQ(sut.missing(), (Missing{.complete = 2, .unseen = 2}));
}

}  // namespace
}  // namespace millrace::tools::recording
