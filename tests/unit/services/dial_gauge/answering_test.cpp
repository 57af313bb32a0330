#include "services/dial_gauge/answering.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::services::dial_gauge {
namespace {

using namespace std::chrono_literals;
using sdk::Response;
using testing::HasSubstr;
using testing::StartsWith;

/// Returns the reading that the test sets.
class FakeSource : public Source {
 public:
  explicit FakeSource(tl::expected<Reading, Failure>& next) : next_(next) {}
  tl::expected<Reading, Failure> read(Time /*now*/) override { return next_; }
  [[nodiscard]] bool has_reading() const override { return next_.has_value(); }
  [[nodiscard]] Condition condition() const override {
    return {.battery_percent = 87, .readings = 5, .failures = 1};
  }

 private:
  tl::expected<Reading, Failure>& next_;
};

class AnsweringTest : public testing::Test {
 protected:
  AnsweringTest() {
    sut.add({.name = "depth", .maximum = 20 * nanometres_per_mm, .max_age = 2s},
            std::make_unique<FakeSource>(next));
  }

  const Time now = Time{} + 100s;
  tl::expected<Reading, Failure> next = Reading{.value = 12'345'000, .taken = now};
  tl::expected<void, std::string> keeping{};
  Zeros kept;
  Answering sut{{}, [this](const Zeros& zeros) {
                  kept = zeros;
                  return keeping;
                }};
};

TEST_F(AnsweringTest, AnswersAValueWithItsUnit) {
  EXPECT_EQ(sut.answer("READ depth", now), (Response{.text = "12.345 mm", .state = 1}));
}

TEST_F(AnsweringTest, AnswersOnlyTheNumberOnRequest) {
  EXPECT_EQ(sut.answer("READ depth mm", now), (Response{.text = "12.345", .state = 1}));
  next = Reading{.value = 500'000, .taken = now};
  EXPECT_EQ(sut.answer("ZERO depth", now).state, 1U);
  next = Reading{.value = 400'000, .taken = now};
  EXPECT_EQ(sut.answer("READ depth mm", now), (Response{.text = "-0.100", .state = 1}));
}

TEST_F(AnsweringTest, RefusesWhatIsNoRequest) {
  EXPECT_EQ(sut.answer("", now).state, 10U);
  EXPECT_THAT(sut.answer("READ", now).text, StartsWith("ERROR: expected READ gauge [mm], ZERO"));
}

TEST_F(AnsweringTest, NamesTheExistingGaugesForAnUnknownOne) {
  EXPECT_EQ(sut.answer("READ depht", now), text::error(11, "no gauge 'depht'; there is depth"));
}

TEST_F(AnsweringTest, RefusesAValueOutsideTheRange) {
  next = Reading{.value = 20'001'000, .taken = now};
  EXPECT_EQ(sut.answer("READ depth", now),
            text::error(12, "depth shows 20.001 mm, range 0.000 mm to 20.000 mm"));
  next = Reading{.value = -1'000, .taken = now};
  EXPECT_EQ(sut.answer("READ depth", now).state, 12U);
}

TEST_F(AnsweringTest, ReportsLossOfRadioContact) {
  next = tl::unexpected(Failure{Fault::no_contact, "the radio is silent"});
  EXPECT_EQ(sut.answer("READ depth", now),
            text::error(13, "no radio contact of depth: the radio is silent"));
}

TEST_F(AnsweringTest, ReportsALowBattery) {
  next = tl::unexpected(Failure{Fault::battery_low, "8 % of charge left"});
  EXPECT_EQ(sut.answer("READ depth", now).state, 14U);
}

TEST_F(AnsweringTest, RefusesAValueThatIsTooOld) {
  EXPECT_EQ(sut.answer("READ depth", now + 2s).state, 1U);
  EXPECT_EQ(sut.answer("READ depth", now + 2001ms),
            text::error(15, "value of depth is 2.0 s old, at most 2.0 s"));
}

TEST_F(AnsweringTest, ReportsThatTheReceiverIsGone) {
  next = tl::unexpected(Failure{Fault::line_down, "/dev/x: gone"});
  EXPECT_EQ(sut.answer("READ depth", now).state, 16U);
}

TEST_F(AnsweringTest, MeasuresFromTheZeroPointThatWasSet) {
  EXPECT_EQ(sut.answer("ZERO depth", now), (Response{.text = "0.000 mm", .state = 1}));
  EXPECT_EQ(kept, (Zeros{{"depth", 12'345'000}}));
  next = Reading{.value = 12'340'000, .taken = now};
  EXPECT_EQ(sut.answer("READ depth", now).text, "-0.005 mm");
}

TEST_F(AnsweringTest, KeepsTheOldZeroPointIfTheNewOneCannotBeKept) {
  keeping = tl::unexpected(std::string("disk full"));
  EXPECT_EQ(sut.answer("ZERO depth", now), text::error(17, "zero point not set: disk full"));
  EXPECT_EQ(sut.answer("READ depth", now).text, "12.345 mm");
}

TEST_F(AnsweringTest, SetsNoZeroPointWithoutAGoodReading) {
  next = tl::unexpected(Failure{Fault::no_contact, "silent"});
  EXPECT_EQ(sut.answer("ZERO depth", now).state, 13U);
  EXPECT_TRUE(kept.empty());
}

TEST_F(AnsweringTest, ReportsTheConditionOfAGauge) {
  EXPECT_EQ(
      sut.answer("STATUS depth", now + 1500ms),
      (Response{.text = "OK age 1.5 s, battery 87 %, zero at 0.000 mm, 5 readings, 1 failures",
                .state = 1}));
}

TEST_F(AnsweringTest, ListsItsGauges) {
  sut.add({.name = "bore"}, std::make_unique<FakeSource>(next));
  EXPECT_EQ(sut.answer("LIST", now), (Response{.text = "bore depth", .state = 1}));
}

TEST_F(AnsweringTest, CountsTheGaugesThatDoNotFitTheList) {
  for (int i = 0; i < 40; ++i) {
    sut.add({.name = "gauge-" + std::to_string(i)}, std::make_unique<FakeSource>(next));
  }
  const Response answer = sut.answer("LIST", now);
  EXPECT_LE(answer.text.size(), 127U);
  EXPECT_THAT(answer.text, HasSubstr(" more"));
}

TEST(WithoutGauges, ListsNone) {
  Answering sut({}, {});
  EXPECT_EQ(sut.answer("LIST", Time{}).text, "none");
}

TEST_F(AnsweringTest, RemembersAGaugeThatAProgramCouldNotReadUntilItCanBeRead) {
  EXPECT_EQ(sut.answer("READ depth", now).state, 1U);
  EXPECT_TRUE(sut.failing().empty());
  next = tl::unexpected(Failure{Fault::no_contact, "the radio is silent"});
  EXPECT_EQ(sut.answer("READ depth", now).state, state_no_contact);
  sut.look();
  ASSERT_TRUE(sut.failing().contains("depth"));
  EXPECT_EQ(sut.failing().at("depth"), "no radio contact of depth: the radio is silent");
  next = Reading{.value = 12'345'000, .taken = now};
  sut.look();
  EXPECT_TRUE(sut.failing().empty());
}

TEST_F(AnsweringTest, CountsAnOldOrOutOfRangeValueAsNoFaultOfTheGauge) {
  EXPECT_EQ(sut.answer("READ depth", now + 3s).state, state_too_old);
  next = Reading{.value = 21 * nanometres_per_mm, .taken = now};
  EXPECT_EQ(sut.answer("READ depth", now).state, state_out_of_range);
  EXPECT_TRUE(sut.failing().empty());
}

}  // namespace
}  // namespace millrace::services::dial_gauge
