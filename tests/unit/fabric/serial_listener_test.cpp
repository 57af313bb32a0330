#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "fabric/dds/listeners.hpp"

namespace millrace::fabric {
namespace {

TEST(SerialListener, RunsNothingBeforeItIsOpened) {
  int runs = 0;
  dds::SerialListener sut([&] { ++runs; });
  sut.run();
  EXPECT_EQ(runs, 0);
  sut.open();
  EXPECT_GE(runs, 1);
}

TEST(SerialListener, RunsOnceMoreForWhatComesDuringTheWork) {
  int runs = 0;
  dds::SerialListener* sut = nullptr;
  dds::SerialListener serial([&] {
    if (++runs == 1) {
      sut->run();
      EXPECT_EQ(runs, 1) << "not within itself";
    }
  });
  sut = &serial;
  serial.open();
  EXPECT_EQ(runs, 2);
}

// A regression: the next thread assumed that another one ran the work already, and left, so no
// further samples were taken.
TEST(SerialListener, ContinuesAfterWorkThatThrows) {
  int runs = 0;
  dds::SerialListener sut([&] {
    if (++runs <= 2) {
      throw std::runtime_error("on purpose, by a test");
    }
  });
  sut.open();
  sut.run();
  sut.run();
  EXPECT_EQ(runs, 3);
}

TEST(SerialListener, RunsInOneThreadAtATimeAndMissesNothing) {
  constexpr int threads = 4;
  constexpr int each = 20'000;
  std::atomic<int> brought = 0;
  // Neither is atomic: the thread sanitizer, at the latest, would find two threads.
  int inside = 0;
  int seen = 0;
  dds::SerialListener sut([&] {
    EXPECT_EQ(++inside, 1);
    seen = brought.load();
    --inside;
  });
  sut.open();
  std::vector<std::jthread> all;
  for (int i = 0; i < threads; ++i) {
    all.emplace_back([&] {
      for (int j = 0; j < each; ++j) {
        ++brought;
        sut.run();
      }
    });
  }
  all.clear();
  EXPECT_EQ(seen, threads * each);
}

}  // namespace
}  // namespace millrace::fabric
