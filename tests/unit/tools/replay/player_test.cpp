#include "tools/replay/player.hpp"

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/wire/codec.hpp"
#include "fabric/wire/reader.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/tools/replay/sample_plan.hpp"
#include "tools/replay/as_service.hpp"
#include "tools/replay/scheduler.hpp"

namespace millrace::tools::replay {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using tests::run_until;
using Clock = std::chrono::steady_clock;

/// Answers at once, except calls in `silent`.
struct Answering : Stage {
  void issue(std::size_t call) override {
    issued.push_back(call);
    if (!silent.contains(call)) {
      player->ended(call, Answer{"1.414214", 1, std::nullopt}, "");
    }
  }
  void withdraw(std::size_t call, const fabric::Message& reason) override {
    player->ended(call, std::nullopt, reason);
  }
  void on_outcome(const Outcome& outcome) override { outcomes.push_back(outcome); }
  void on_done() override { done = true; }

  std::set<std::size_t> silent;
  std::vector<std::size_t> issued;
  std::vector<Outcome> outcomes;
  bool done = false;
  Player* player = nullptr;
};

class PlayerTest : public testing::Test {
 protected:
  void play(PlayOptions options) {
    player.emplace(io.get_executor(), plan, options, stage);
    stage.player = &*player;
    player->start();
  }

  boost::asio::io_context io;
  Plan plan{{planned(1, 0ms, 5ms), planned(2, 20ms, 5ms), planned(1, 40ms, 5ms)}, {}};
  Answering stage;
  std::optional<Player> player;
};

TEST_F(PlayerTest, PlaysEveryCallAtItsTimeAndEnds) {
  const auto start = std::chrono::steady_clock::now();
  play({});
  ASSERT_TRUE(run_until(io, [&] { return stage.done; }));
  EXPECT_GE(std::chrono::steady_clock::now() - start, 40ms);
  EXPECT_THAT(stage.issued, ElementsAre(0, 1, 2));
  for (const Outcome& outcome : stage.outcomes) {
    EXPECT_GE(outcome.late, 0ms);
    EXPECT_FALSE(outcome.held_up);
  }
}

TEST_F(PlayerTest, PlaysRounds) {
  play({.pace = {.timing = Timing::fast}, .rounds = 3});
  ASSERT_TRUE(run_until(io, [&] { return stage.done; }));
  EXPECT_THAT(stage.issued, ElementsAre(0, 1, 2, 0, 1, 2, 0, 1, 2));
  EXPECT_EQ(stage.outcomes.back().round, 3U);
  EXPECT_EQ(player->finished(), 9U);
}

TEST_F(PlayerTest, EndsACallThatTakesTooLong) {
  stage.silent = {1};
  play({.pace = {.timing = Timing::fast}, .patience = 30ms});
  ASSERT_TRUE(run_until(io, [&] { return stage.done; }));
  EXPECT_THAT(stage.issued, ElementsAre(0, 1, 2));
  EXPECT_THAT(stage.outcomes[1].reason, HasSubstr("no response within 0.03 s"));
}

TEST_F(PlayerTest, WithdrawsWhatWasWithdrawnInTheRecording) {
  plan.calls[1].answer.reset();
  plan.calls[1].withdrawn_after = 10ms;
  stage.silent = {1};
  play({});
  ASSERT_TRUE(run_until(io, [&] { return stage.done; }));
  EXPECT_THAT(stage.outcomes[1].reason, HasSubstr("as in the recording"));
  EXPECT_GE(stage.outcomes[1].took, 10ms);
}

TEST_F(PlayerTest, StopsOnRequest) {
  stage.silent = {0};
  play({});
  ASSERT_TRUE(run_until(io, [&] { return !stage.issued.empty(); }));
  player->stop("enough");
  ASSERT_TRUE(run_until(io, [&] { return stage.done; }));
  EXPECT_THAT(stage.issued, ElementsAre(0));
  EXPECT_EQ(stage.outcomes[0].reason, "enough");
}

TEST_F(PlayerTest, MakesNoMoreRequestsOnceItIsStopped) {
  stage.silent = {0};
  play({.pace = {.timing = Timing::fast}});
  ASSERT_TRUE(run_until(io, [&] { return !stage.issued.empty(); }));
  player->stop("enough");
  ASSERT_TRUE(run_until(io, [&] { return stage.done; }));
  EXPECT_THAT(stage.issued, ElementsAre(0));
}

TEST_F(PlayerTest, StepsThroughThePlan) {
  play({.pace = {.timing = Timing::step}});
  EXPECT_EQ(player->upcoming(), 0U);
  for (std::size_t i = 0; i < 3; ++i) {
    player->allow();
    ASSERT_TRUE(run_until(io, [&] { return stage.issued.size() == i + 1; }));
  }
  ASSERT_TRUE(run_until(io, [&] { return stage.done; }));
  EXPECT_EQ(player->upcoming(), std::nullopt);
}

std::vector<std::size_t> all_due(Scheduler& sut, nanoseconds now) {
  std::vector<std::size_t> due;
  while (const auto call = sut.next(now)) {
    due.push_back(*call);
  }
  return due;
}

TEST(Scheduler, IssuesEachCallAtItsTime) {
  const Plan plan{{planned(1, 0ms, 5ms), planned(2, 10ms, 5ms), planned(1, 20ms, 5ms)}, {}};
  Scheduler sut(plan, {});
  EXPECT_THAT(all_due(sut, 0ms), ElementsAre(0));
  EXPECT_EQ(sut.next_time(), 10ms);
  EXPECT_THAT(all_due(sut, 9ms), IsEmpty());
  EXPECT_THAT(all_due(sut, 10ms), ElementsAre(1));
  sut.ended(0);
  EXPECT_EQ(sut.next_time(), 20ms);
  EXPECT_THAT(all_due(sut, 20ms), ElementsAre(2));
  EXPECT_FALSE(sut.done());
  sut.ended(1);
  sut.ended(2);
  EXPECT_TRUE(sut.done());
}

TEST(Scheduler, IsFasterAndSlowerByTheRate) {
  const Plan plan{{planned(1, 0ms, 5ms), planned(2, 100ms, 5ms)}, {}};
  Scheduler fast(plan, {.rate = 10});
  EXPECT_THAT(all_due(fast, 10ms), ElementsAre(0, 1));
  Scheduler slow(plan, {.rate = 0.5});
  EXPECT_THAT(all_due(slow, 199ms), ElementsAre(0));
  EXPECT_EQ(slow.next_time(), 200ms);
}

TEST(Scheduler, HasOneCallAtATimeInEachChannel) {
  const Plan plan{{planned(1, 0ms, 5ms), planned(1, 10ms, 5ms), planned(2, 11ms, 5ms)}, {}};
  Scheduler sut(plan, {});
  EXPECT_THAT(all_due(sut, 0ms), ElementsAre(0));
  // The first one takes longer than in the recording.
  EXPECT_THAT(all_due(sut, 30ms), ElementsAre(2));
  EXPECT_EQ(sut.next_time(), std::nullopt);
  sut.ended(0);
  EXPECT_THAT(all_due(sut, 30ms), ElementsAre(1));
  EXPECT_TRUE(sut.was_held_up(1));
  EXPECT_FALSE(sut.was_held_up(2));
}

TEST(Scheduler, GoesFastWithoutRunningAtOnceWhatRanOneAfterTheOther) {
  // Channel 2 calls while channel 1's first call runs, and again after it has ended.
  const Plan plan{{planned(1, 0ms, 50ms), planned(2, 10ms, 5ms), planned(2, 100ms, 5ms)}, {}};
  Scheduler sut(plan, {.timing = Timing::fast});
  EXPECT_THAT(all_due(sut, 0ms), ElementsAre(0, 1));
  sut.ended(1);
  EXPECT_THAT(all_due(sut, 0ms), IsEmpty());
  sut.ended(0);
  EXPECT_THAT(all_due(sut, 0ms), ElementsAre(2));
}

TEST(Scheduler, DoesNotWaitForACallThatNeverEndedInTheRecording) {
  Plan plan{{planned(1, 0ms, 50ms), planned(2, 100ms, 5ms)}, {}};
  plan.calls[0].answer.reset();
  Scheduler sut(plan, {.timing = Timing::fast});
  EXPECT_THAT(all_due(sut, 0ms), ElementsAre(0, 1));
}

TEST(Scheduler, StepsWhenItIsAllowed) {
  const Plan plan{{planned(1, 0ms, 5ms), planned(2, 1ms, 5ms)}, {}};
  Scheduler sut(plan, {.timing = Timing::step});
  EXPECT_THAT(all_due(sut, 1s), IsEmpty());
  sut.allow();
  sut.allow();
  EXPECT_THAT(all_due(sut, 1s), ElementsAre(0));
  sut.ended(0);
  EXPECT_THAT(all_due(sut, 1s), ElementsAre(1));
}

TEST(Scheduler, GoesThroughALongPlanInOrderOfEachChannelWhateverTheEnds) {
  Plan plan;
  for (int i = 0; i < 1000; ++i) {
    plan.calls.push_back(
        planned(static_cast<std::uint16_t>(1 + i * 7 % 5), std::chrono::milliseconds(i), 3ms));
  }
  for (const Timing timing : {Timing::timed, Timing::fast}) {
    Scheduler sut(plan, {.timing = timing});
    std::map<fabric::ChannelKey, std::size_t> last;
    std::vector<std::size_t> open;
    nanoseconds now{};
    while (!sut.done()) {
      for (const std::size_t call : all_due(sut, now)) {
        const auto [place, first] = last.try_emplace(plan.calls[call].channel, call);
        EXPECT_TRUE(first || place->second < call);
        place->second = call;
        open.push_back(call);
      }
      now += 700us;
      if (!open.empty()) {
        // The newest ends first.
        sut.ended(open.back());
        open.pop_back();
      }
    }
    EXPECT_EQ(sut.issued(), 1000U);
  }
}

struct Listener : AsServiceListener {
  void on_match(const fabric::Request&, std::size_t call) override { matched.push_back(call); }
  void on_mismatch(const fabric::Request&, const std::string& reason) override {
    mismatches.push_back(reason);
  }
  void on_drain(const fabric::InstanceIdentity&, const std::string&) override {}
  void on_complete() override { complete = true; }

  std::vector<std::size_t> matched;
  std::vector<std::string> mismatches;
  bool complete = false;
};

class AsServiceTest : public testing::Test {
 protected:
  static std::map<fabric::ChannelKey, fabric::ChannelKey> same_channels(const Plan& plan) {
    std::map<fabric::ChannelKey, fabric::ChannelKey> channels;
    for (const PlannedCall& call : plan.calls) {
      channels.emplace(call.channel, call.channel);
    }
    return channels;
  }
  AsService& stand_in(Plan recorded) {
    plan = std::move(recorded);
    return sut.emplace(participant, io.get_executor(), plan,
                       AsServiceOptions{.channels = same_channels(plan), .name = "stand-in"},
                       listener);
  }
  /// As a gateway dispatches it to the only instance.
  fabric::Request given(std::uint64_t number, std::uint16_t channel = 1) {
    fabric::Request request = request_entry(number, channel);
    request.assigned = sut->instances().at(0).id;
    return request;
  }

  tests::Domain domain;
  boost::asio::io_context io;
  fabric::dds::Participant participant{{.domain = domain.number()}};
  Listener listener;
  Plan plan;
  std::optional<AsService> sut;
};

// Both timers have expired when the loop checks them: the first one withdraws the call of the
// second.
TEST_F(AsServiceTest, IsNotEndedByTheTimerOfACallThatWasWithdrawn) {
  stand_in({.calls = {planned(1, 0ms, 10ms), planned(1, 20ms, 0ms)}});
  io.poll();
  boost::asio::steady_timer withdraws(io, Clock::now());
  const fabric::Request request = given(1);
  withdraws.async_wait(
      [&](const boost::system::error_code&) { sut->on_withdrawn(fabric::key_of(request)); });
  sut->on_request(request);
  const auto both = Clock::now() + 50ms;
  while (Clock::now() < both) {
    // The loop does not turn until here.
  }
  io.restart();
  EXPECT_NO_THROW(io.poll());
  sut->on_request(given(2));
  EXPECT_THAT(listener.matched, ElementsAre(0, 1));
  EXPECT_THAT(listener.mismatches, IsEmpty());
}

TEST_F(AsServiceTest, SendsHeartbeatsForItsInstancesAndNamesTheCallsTheyHave) {
  fabric::dds::Participant gateway{{.domain = domain.number()}};
  fabric::wire::Reader<fabric::Heartbeat> heartbeats(gateway, "millrace", fabric::wire::Keep::last);
  stand_in({.calls = {planned(1, 0ms, 1h), planned(1, 20ms, 0ms)}});
  EXPECT_EQ(sut->instances().at(0).lease, participant.options().lease);

  fabric::InstanceLoad last_load;
  const auto until_load = [&](const std::function<bool()>& enough) {
    return run_until(io, [&] {
      for (const auto& taken : heartbeats.take()) {
        for (const fabric::InstanceLoad& load : taken.value.loads) {
          last_load = load;
        }
      }
      return enough();
    });
  };
  const fabric::InstanceId instance = sut->instances().at(0).id;
  ASSERT_TRUE(until_load([&] { return last_load.status.instance == instance; }));
  EXPECT_THAT(last_load.calls, IsEmpty());

  const fabric::Request request = given(1);
  sut->on_request(request);
  ASSERT_TRUE(until_load([&] { return last_load.status.running == 1; }));
  EXPECT_THAT(last_load.calls, ElementsAre(request.call));

  sut->on_withdrawn(fabric::key_of(request));
  sut->on_request(given(2));
  ASSERT_TRUE(until_load([&] { return last_load.status.answered == 1; }));
  EXPECT_EQ(last_load.status.cancelled, 1U);
  EXPECT_THAT(last_load.calls, IsEmpty());
}

}  // namespace
}  // namespace millrace::tools::replay
