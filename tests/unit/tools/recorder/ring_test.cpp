#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/recorder/recorder.hpp"

namespace millrace::tools::recorder {
namespace {

using recording::Entry;
using recording::tests::at;

constexpr std::uint64_t plenty = 1 << 20;

Entry entry(double milliseconds) {
  return {.at = at(milliseconds), .sample = recording::Withdrawal{}};
}

std::vector<fabric::Time> times(Ring& ring) {
  std::vector<fabric::Time> times;
  ring.take([&](const Entry& taken) { times.push_back(taken.at); });
  return times;
}

TEST(Ring, KeepsTheNewestInTheirOrder) {
  Ring sut(std::chrono::milliseconds(10), plenty);
  for (int i = 0; i <= 30; i += 5) {
    sut.add(entry(i));
  }
  EXPECT_EQ(times(sut), (std::vector{at(20), at(25), at(30)}));
  EXPECT_EQ(sut.count(), 0U);
  EXPECT_EQ(sut.crowded_out(), 0U);
}

TEST(Ring, RemovesTheOldestWhenTheMemoryIsFull) {
  Ring sut(std::chrono::hours(1), 10 * sizeof(Entry));
  for (int i = 0; i < 100; ++i) {
    sut.add(entry(i));
  }
  EXPECT_LE(sut.count(), 10U);
  EXPECT_EQ(sut.count() + sut.crowded_out(), 100U);
  EXPECT_EQ(times(sut).back(), at(99));
}

}  // namespace
}  // namespace millrace::tools::recorder
