#include "services/dial_gauge/answering.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/dial_gauge/config.hpp"
#include "tests/support/data.hpp"
#include "tests/support/expected_mistakes.hpp"
#include "tests/support/temporary_folder.hpp"

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

TEST(GaugeRequest, IsAVerbAndAGauge) {
  EXPECT_EQ(parse("READ depth"), (Request{Verb::read, "depth"}));
  EXPECT_EQ(parse("ZERO depth"), (Request{Verb::zero, "depth"}));
  EXPECT_EQ(parse("STATUS G-1_b"), (Request{Verb::status, "G-1_b"}));
  EXPECT_EQ(parse("LIST"), (Request{Verb::list, ""}));
}

TEST(GaugeRequest, MayRequestTheNumberOnly) {
  EXPECT_EQ(parse("READ depth mm"), (Request{Verb::read, "depth", true}));
  EXPECT_EQ(parse("read depth MM"), (Request{Verb::read, "depth", true}));
  EXPECT_FALSE(parse("ZERO depth mm"));
  EXPECT_FALSE(parse("READ depth inch"));
}

TEST(GaugeRequest, MayHaveBlanksAndSmallLetters) {
  EXPECT_EQ(parse("  read \t depth "), (Request{Verb::read, "depth"}));
}

class NoGaugeRequest : public testing::TestWithParam<std::string> {};

TEST_P(NoGaugeRequest, IsRefused) {
  EXPECT_FALSE(parse(GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Texts, NoGaugeRequest,
                         testing::Values("", "   ", "READ", "READ a b", "LIST a", "MEASURE a",
                                         "READa", "READ ../../etc/passwd", "READ $(reboot)",
                                         "READ a;b", "READ \xE4", std::string("READ a\0b", 8),
                                         "READ " + std::string(33, 'a'), std::string(127, 'x'),
                                         std::string(127, '\xFF')));

TEST(GaugeRequest, NamesWhatWasExpected) {
  EXPECT_THAT(parse("MEASURE a").error(),
              HasSubstr("expected READ gauge [mm], ZERO|STATUS gauge or LIST"));
  EXPECT_THAT(parse("READ a;b").error(), HasSubstr("'a;b'"));
}

class ZerosFile : public testing::Test {
 protected:
  tests::TemporaryFolder folder;
  std::filesystem::path file = folder.path() / "zeros";
};

TEST_F(ZerosFile, ThatIsMissingHoldsNone) {
  EXPECT_EQ(read_zeros(file), Zeros{});
}

TEST_F(ZerosFile, ReturnsWhatWasStored) {
  const Zeros zeros{{"bore", -5}, {"depth", 12'345'000}};
  ASSERT_TRUE(keep_zeros(file, zeros));
  EXPECT_EQ(read_zeros(file), zeros);
}

TEST_F(ZerosFile, ThatIsBrokenIsAnErrorAndNotNoZeros) {
  std::ofstream(file) << "zero { gauge: ";
  EXPECT_THAT(read_zeros(file).error(), HasSubstr("zeros:1:"));
}

TEST_F(ZerosFile, ThatCannotBeWrittenIsAnError) {
  EXPECT_THAT(keep_zeros(folder.path() / "missing" / "zeros", {}).error(),
              HasSubstr("No such file or directory"));
}

std::filesystem::path data(const std::string& name) {
  return tests::test_data("config") / name;
}

TEST(DialGaugeConfig, ReadsSimulatedGauges) {
  const auto sut = load(data("good/cell.dial_gauge.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  const GaugeConfig& gauge = sut->gauges.at(0);
  EXPECT_EQ(gauge.gauge.name, "depth");
  EXPECT_EQ(gauge.gauge.maximum, 12'700'000);
  EXPECT_EQ(gauge.gauge.max_age, 10s);
  const auto& simulation = std::get<Simulation>(gauge.source);
  EXPECT_EQ(simulation.seed, 7U);
  EXPECT_THAT(simulation.nominal_mm, testing::ElementsAre(5.01, 5.02));
  EXPECT_EQ(simulation.noise_um, 0.8);
}

TEST(DialGaugeConfig, ReadsGaugesOnASerialLine) {
  const auto sut = load(data("good/cell.dial_gauge.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  const auto& radio = std::get<RadioConfig>(sut->gauges.at(1).source);
  EXPECT_EQ(radio.line, 1U);
  EXPECT_EQ(radio.channel, 2U);
  EXPECT_EQ(sut->lines.at(0).baud_rate, 9600U);
  EXPECT_EQ(sut->lines.at(0).unit, Unit::inch);
  EXPECT_EQ(sut->lines.at(1).baud_rate, 57600U);
  EXPECT_EQ(sut->lines.at(1).device, "/dev/ttyUSB0");
}

TEST(DialGaugeConfig, KeepsZeroPointsBesideItself) {
  const auto sut = load(data("good/cell.dial_gauge.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->zero_file, data("good/dial_gauge.zeros"));
}

TEST(DialGaugeConfig, NamesEveryMistakeWithItsPlace) {
  tests::expect_mistakes("dial_gauge", [](const auto& file) {
    const auto sut = load(file);
    return sut ? "no error" : sut.error();
  });
}

TEST(DialGaugeConfig, HasASimulatedGaugeForAFirstTry) {
  const Config sut = demonstration("/tmp");
  EXPECT_EQ(sut.gauges.at(0).gauge.name, "G1");
  EXPECT_EQ(sut.zero_file, "/tmp/dial_gauge.zeros");
}

}  // namespace
}  // namespace millrace::services::dial_gauge
