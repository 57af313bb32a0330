#include "tools/recording/hops.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::recording {
namespace {

using tests::one_call;
using tests::square_root;

double milliseconds(const HopStatistics& hops, Hop hop) {
  const Histogram& times = hops.services().at(square_root).at(static_cast<std::size_t>(hop));
  return std::chrono::duration<double, std::milli>(times.max()).count();
}

void add_all(HopStatistics& sut, const std::vector<Entry>& entries) {
  for (const Entry& entry : entries) {
    sut.add(entry);
  }
}

TEST(HopStatistics, MeasuresEachHop) {
  HopStatistics sut;
  add_all(sut, one_call(1, 0));
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::dispatch), 1);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::to_service), 0.5);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::queue), 0.1);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::work), 3);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::to_gateway), 0.5);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::write_back), 2);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::total), 7.1);
}

TEST(HopStatistics, IgnoresTheOrderOfTheSamplesOfACall) {
  const std::vector<Entry> entries = one_call(1, 0);
  // All orders of request, reply and the three events with their own times.
  std::vector<std::size_t> order{0, 1, 3, 4, 5};
  do {
    HopStatistics sut;
    for (const std::size_t i : order) {
      sut.add(entries[i]);
    }
    sut.close();
    ASSERT_EQ(sut.services().at(square_root).back().count(), 1U);
    ASSERT_DOUBLE_EQ(milliseconds(sut, Hop::total), 7.1);
    ASSERT_DOUBLE_EQ(milliseconds(sut, Hop::dispatch), 1);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(HopStatistics, CountsACallThatAnOperatorAnsweredWhenTheRecordingEnds) {
  std::vector<Entry> entries = one_call(1, 0);
  entries.erase(entries.begin() + 3);  // no reply
  HopStatistics sut;
  add_all(sut, entries);
  EXPECT_TRUE(sut.services().empty());
  sut.close();
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::total), 7.1);
}

TEST(HopStatistics, LeavesWithdrawnCallsOut) {
  std::vector<Entry> entries = one_call(1, 0);
  std::get<fabric::Event>(entries[5].sample).kind = fabric::EventKind::withdrawn;
  HopStatistics sut;
  add_all(sut, entries);
  sut.close();
  EXPECT_TRUE(sut.services().empty());
}

TEST(HopStatistics, CountsCallsThatHaveEndedAndThoseThatFailed) {
  HopStatistics sut;
  add_all(sut, one_call(1, 0));
  add_all(sut, one_call(2, 10));
  sut.add(one_call(2, 10).back());  // a gateway that resumes repeats the end
  std::vector<Entry> withdrawn = one_call(3, 20);
  std::get<fabric::Event>(withdrawn[5].sample).kind = fabric::EventKind::withdrawn;
  add_all(sut, withdrawn);
  sut.add(one_call(4, 30)[1]);  // under way
  EXPECT_EQ(sut.ended(), 3U);
  EXPECT_EQ(sut.failed(), 1U);
  sut.close();
  EXPECT_EQ(sut.ended(), 3U);
  EXPECT_EQ(sut.failed(), 1U);
}

TEST(HopStatistics, ForgetsCallsThatNeverEnd) {
  HopStatistics sut;
  for (std::uint64_t number = 1; number <= 10000; ++number) {
    sut.add(one_call(number, 0)[1]);
  }
  add_all(sut, one_call(20000, 0));
  EXPECT_EQ(sut.services().at(square_root).back().count(), 1U);
}

TEST(HopStatistics, ForgetsTheOldestCallWhateverTheNumbersOfItsGateway) {
  HopStatistics sut;
  for (std::uint64_t number = 1; number <= 5000; ++number) {
    Entry begun = one_call(number, 0)[1];
    std::get<fabric::Request>(begun.sample).call.epoch = 0xffff;
    sut.add(begun);
  }
  // Of a gateway whose epoch is lower than all others.
  for (std::uint64_t number = 1; number <= 100; ++number) {
    add_all(sut, one_call(number, 0));
  }
  EXPECT_EQ(sut.services().at(square_root).back().count(), 100U);
}

}  // namespace
}  // namespace millrace::tools::recording
