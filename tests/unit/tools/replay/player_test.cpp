#include "tools/replay/player.hpp"

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/run_until.hpp"
#include "tests/unit/tools/replay/sample_plan.hpp"

namespace millrace::tools::replay {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using tests::run_until;

/// Answers at once, except calls in `silent`.
struct Answering : Stage {
  void issue(std::size_t call) override {
    issued.push_back(call);
    if (!silent.contains(call)) {
      player->ended(call, Answer{"1.414214", 1, std::nullopt}, "");
    }
  }
  void withdraw(std::size_t call, const std::string& reason) override {
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

}  // namespace
}  // namespace millrace::tools::replay
