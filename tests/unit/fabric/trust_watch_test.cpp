#include "fabric/dds/trust_watch.hpp"

#include <mutex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/await.hpp"

namespace millrace::fabric::dds {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using Clock = std::chrono::steady_clock;

class ATrustWatch : public testing::Test {
 protected:
  /// A participant that has lost `lost` alone, from its beginning, with a lease of 100 s.
  [[nodiscard]] TrustWatch watch() {
    return {std::make_shared<const Trust>(trust), 100s,
            TrustWatch::Reported{.revoked = [](const auto&) { return std::vector<std::string>(); },
                                 .lost_on_one_side =
                                     [this](Clock::time_point) {
                                       const std::lock_guard guard(lock);
                                       ++checks;
                                       return lost;
                                     },
                                 .slept =
                                     [this] {
                                       const std::lock_guard guard(lock);
                                       return std::chrono::nanoseconds(slept);
                                     },
                                 .log = [this](std::string text) { add_line(std::move(text)); }}};
  }
  void add_line(std::string text) {
    const std::lock_guard guard(lock);
    lines.push_back(std::move(text));
  }
  bool until_reported() {
    tests::await("a report", [this] {
      const std::lock_guard guard(lock);
      return !lines.empty();
    });
    return true;
  }

  Trust trust{
      .name = "office",
      .until = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now() + 24h)};
  /// For all that follows, which the thread of the watch changes.
  std::mutex lock;
  std::vector<std::string> lines;
  int checks = 0;
  std::optional<std::string> lost = "square-root";
  std::chrono::seconds slept{};
};

TEST_F(ATrustWatch, AsksForANewParticipantOnlyWhenThisOneIsOldEnough) {
  trust.least_age = 3s;
  trust.needs_new_participant = [this](const std::string& reason) { add_line(reason); };
  const auto begin = Clock::now();
  const TrustWatch sut = watch();
  ASSERT_TRUE(until_reported());
  EXPECT_GE(Clock::now() - begin, trust.least_age);
  const std::lock_guard guard(lock);
  EXPECT_GT(checks, 1);
  EXPECT_THAT(lines, ElementsAre(HasSubstr("the network to square-root was down")));
}

TEST_F(ATrustWatch, ReportsOnceWhatAProcessOfSomebodyElseNeeds) {
  trust.least_age = 0s;
  const TrustWatch sut = watch();
  ASSERT_TRUE(until_reported());
  tests::await("further checks", [this] {
    const std::lock_guard guard(lock);
    return checks > 3;
  });
  const std::lock_guard guard(lock);
  EXPECT_THAT(lines,
              ElementsAre(AllOf(HasSubstr("square-root"), HasSubstr("start this process again"))));
}

TEST_F(ATrustWatch, AsksForANewParticipantOnceTheHostHasSleptLongerThanItsLease) {
  trust.needs_new_participant = [this](const std::string& reason) { add_line(reason); };
  lost.reset();
  slept = 1000s;
  const TrustWatch sut = watch();
  const auto sleep = [this](std::chrono::seconds time) {
    const std::lock_guard guard(lock);
    slept += time;
    return checks;
  };
  const auto await_checks = [this](int before) {
    tests::await("two more checks", [&] {
      const std::lock_guard guard(lock);
      return checks > before + 1;
    });
  };
  await_checks(sleep(100s));
  {
    const std::lock_guard guard(lock);
    EXPECT_THAT(lines, testing::IsEmpty());
  }
  await_checks(sleep(101s));
  const std::lock_guard guard(lock);
  EXPECT_THAT(lines, ElementsAre(HasSubstr("the host slept")));
}

}  // namespace
}  // namespace millrace::fabric::dds
