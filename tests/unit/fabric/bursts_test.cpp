#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "fabric/endpoints/burst.hpp"
#include "fabric/endpoints/turn.hpp"

namespace millrace::fabric::endpoints {
namespace {

/// Writes this many requests before the executor comes back.
void write(Turn& sut, int requests) {
  for (int i = 0; i < requests; ++i) {
    sut.on_written();
  }
}

/// Until it is over: how often the executor came back.
unsigned finish(Turn& sut) {
  unsigned rounds = 1;
  while (!sut.on_round()) {
    ++rounds;
  }
  return rounds;
}

TEST(ATurn, SendsASingleRequestAtOnceAndIsOverInOneRound) {
  Turn sut;
  for (int call = 0; call < 3; ++call) {
    EXPECT_FALSE(sut.running());
    EXPECT_TRUE(sut.on_written());
    EXPECT_TRUE(sut.running());
    EXPECT_TRUE(sut.on_round());
  }
}

TEST(ATurn, LetsFurtherRequestsWaitForItsEnd) {
  Turn sut;
  EXPECT_TRUE(sut.on_written());
  EXPECT_FALSE(sut.on_written());
  EXPECT_FALSE(sut.on_written());
}

TEST(ATurn, SendsNoRequestAtOnceAfterATurnOfSeveral) {
  Turn sut;
  write(sut, 2);
  finish(sut);
  EXPECT_FALSE(sut.on_written());
  finish(sut);
  // That was a single one.
  EXPECT_TRUE(sut.on_written());
}

TEST(ATurn, EndsWhenARoundBringsNoRequest) {
  Turn sut;
  write(sut, 2);
  EXPECT_FALSE(sut.on_round());
  write(sut, 1);
  EXPECT_FALSE(sut.on_round());
  EXPECT_TRUE(sut.on_round());
  EXPECT_FALSE(sut.running());
}

TEST(ATurn, EndsAlthoughEachRoundBringsARequest) {
  Turn sut;
  write(sut, 2);
  unsigned rounds = 1;
  while (!sut.on_round()) {
    write(sut, 1);
    ++rounds;
  }
  EXPECT_EQ(rounds, Turn::most_rounds);
  // The next one has all its rounds again.
  write(sut, 1);
  EXPECT_FALSE(sut.on_round());
}

TEST(ATurn, KeepsNoRequestForMoreThanItsRounds) {
  std::mt19937 random(20261130);
  Turn sut;
  bool waits = false;
  unsigned waited = 0;
  for (int step = 0; step < 100'000; ++step) {
    const bool was_running = sut.running();
    if (!was_running || random() % 3 == 0) {
      const bool at_once = sut.on_written();
      EXPECT_FALSE(at_once && was_running);
      waits = waits || !at_once;
    } else if (sut.on_round()) {
      waits = false;
      waited = 0;
    } else {
      EXPECT_TRUE(waits) << "a round for nothing";
      ASSERT_LT(++waited, Turn::most_rounds);
    }
  }
}

using std::chrono::microseconds;

class ABurst : public testing::Test {
 protected:
  /// A sample that comes after this time; whether it is handled at once, which takes no time.
  bool comes_after(microseconds pause) {
    now_ += pause;
    const bool at_once = sut.on_sample(now_);
    if (at_once) {
      sut.on_handled(now_);
    }
    return at_once;
  }
  /// The samples of a datagram after a quiet time; how many are handled at once.
  int datagram(int samples) {
    int at_once = comes_after(microseconds(1000)) ? 1 : 0;
    for (int i = 1; i < samples; ++i) {
      at_once += comes_after(microseconds(1)) ? 1 : 0;
    }
    return at_once;
  }

  Burst sut;

 private:
  SteadyTime now_ = SteadyTime(std::chrono::hours(1));
};

TEST_F(ABurst, IsNotMadeOfSingleCalls) {
  for (int call = 0; call < 5; ++call) {
    EXPECT_TRUE(comes_after(Burst::pause));
  }
}

TEST_F(ABurst, IsNotMadeOfTwoCallsAtATime) {
  EXPECT_EQ(datagram(2), 2);
  EXPECT_EQ(datagram(2), 2);
  EXPECT_EQ(datagram(2), 2);
}

TEST_F(ABurst, LeavesAllButItsFirstTwoSamplesToTheExecutor) {
  EXPECT_EQ(datagram(5), 2);
}

TEST_F(ABurst, IsLeftToTheExecutorAfterALongOne) {
  datagram(3);
  EXPECT_EQ(datagram(3), 0);
  EXPECT_EQ(datagram(1), 0);
  // That was a short one.
  EXPECT_EQ(datagram(1), 1);
}

TEST_F(ABurst, GoesOnAfterASampleWhoseHandlingTookLong) {
  const SteadyTime start = SteadyTime(std::chrono::hours(2));
  sut.on_sample(start);
  sut.on_handled(start + microseconds(500));
  sut.on_sample(start + microseconds(501));
  sut.on_handled(start + microseconds(900));
  EXPECT_FALSE(sut.on_sample(start + microseconds(901)));
}

}  // namespace
}  // namespace millrace::fabric::endpoints
