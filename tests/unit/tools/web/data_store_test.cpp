#include "tools/web/plant/data_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::web::plant {
namespace {

using fabric::DataSample;
using fabric::Quality;
using fabric::Value;
using fabric::ValueType;
using recording::tests::at;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

Value real(double value, double ms, Quality quality = Quality::good) {
  return {.name = "X",
          .type = ValueType::real64,
          .quality = quality,
          .at = at(ms),
          .elements = std::vector<double>{value},
          .reason = quality == Quality::good ? "" : "the link is down"};
}

Value text(const std::string& value, double ms) {
  return {.name = "T",
          .type = ValueType::string,
          .at = at(ms),
          .elements = std::vector<std::string>{value}};
}

DataSample sample(std::vector<Value> values, double ms, const std::string& group = "axes") {
  return {.key = {"press", 1},
          .group = group,
          .at = at(ms),
          .period = std::chrono::milliseconds(100),
          .wanted = std::chrono::milliseconds(100),
          .values = std::move(values)};
}

class ADataStore : public testing::Test {
 protected:
  void tell(const DataSample& data, double ms) { sut.add(data, at(ms)); }
  [[nodiscard]] boost::json::object line(const std::string& variable = "1/axes/X",
                                         fabric::Time since = {}) const {
    const auto series = sut.history("press", {{variable, since}}, at(0)).at("series").as_array();
    return series.empty() ? boost::json::object() : series.at(0).as_object();
  }
  /// The values of a line, "-" for unknown ones.
  [[nodiscard]] std::vector<std::string> values(const std::string& variable = "1/axes/X",
                                                fabric::Time since = {}) const {
    std::vector<std::string> out;
    const boost::json::object series = line(variable, since);
    for (const auto& value : series.at("values").as_array()) {
      out.push_back(value.is_null() ? "-" : fmt::format("{}", value.to_number<double>()));
    }
    return out;
  }

  DataStore sut;
};

TEST_F(ADataStore, KeepsAPointWhereANumberChanges) {
  for (const double ms : {0, 1000, 2000}) {
    tell(sample({real(1.5, ms)}, ms), ms);
  }
  tell(sample({real(2.5, 3000)}, 3000), 3000);
  EXPECT_THAT(values(), ElementsAre("1.5", "2.5"));
  EXPECT_EQ(line().at("times").at(1).as_int64() - line().at("times").at(0).as_int64(), 3000);
  EXPECT_EQ(line().at("value"), 2.5);
}

TEST_F(ADataStore, HasAGapWhereAValueIsNotGood) {
  tell(sample({real(1, 0)}, 0), 0);
  tell(sample({real(1, 0, Quality::stale)}, 1000), 1000);
  tell(sample({real(3, 2000)}, 2000), 2000);
  EXPECT_THAT(values(), ElementsAre("1", "-", "3"));
  EXPECT_EQ(line().at("quality"), "good");
}

TEST_F(ADataStore, HasAGapOnceItsGroupIsRetracted) {
  tell(sample({real(1, 0)}, 0), 0);
  tell(sample({}, 500), 500);
  EXPECT_THAT(values(), ElementsAre("1", "-"));
  EXPECT_EQ(line().at("gone"), true);
  EXPECT_EQ(sut.samples({}).at(0).at("gone"), true);
}

TEST_F(ADataStore, HasAGapOnceItsGatewayFallsSilent) {
  tell(sample({real(1, 0)}, 0), 0);
  sut.silence("other", at(100));
  EXPECT_THAT(values(), ElementsAre("1"));
  sut.silence("press", at(500));
  EXPECT_THAT(values(), ElementsAre("1", "-"));
  tell(sample({real(1, 900)}, 900), 900);
  EXPECT_THAT(values(), ElementsAre("1", "-", "1"));
}

// A gateway does not send unchanged values again, even after its loop was late for a moment.
TEST_F(ADataStore, ShowsTheValuesOfAGatewayAgainWhenItReturns) {
  tell(sample({real(1, 0)}, 0), 0);
  sut.silence("press", at(500));
  sut.end_silence("other", true, at(600));
  EXPECT_EQ(line().at("gone"), true);
  sut.end_silence("press", true, at(700));
  EXPECT_EQ(line().at("gone"), false);
  EXPECT_THAT(values(), ElementsAre("1", "-", "1"));
}

TEST_F(ADataStore, KeepsValuesOfAFormerGatewayGoneUntilTheNextOnePublishesThem) {
  tell(sample({real(1, 0)}, 0), 0);
  sut.silence("press", at(400));
  sut.end_silence("press", false, at(500));
  sut.end_silence("press", true, at(600));
  EXPECT_EQ(line().at("gone"), true);
  tell(sample({real(2, 700)}, 700), 700);
  EXPECT_EQ(line().at("gone"), false);
}

TEST_F(ADataStore, KeepsRetractedGroupsGoneWhicheverGatewayReturns) {
  tell(sample({real(1, 0)}, 0), 0);
  sut.silence("press", at(400));
  tell(sample({}, 500), 500);
  sut.end_silence("press", true, at(700));
  EXPECT_EQ(line().at("gone"), true);
}

TEST_F(ADataStore, ForgetsAGroupThatIsGoneWhenItsLinesAreOld) {
  tell(sample({real(1, 0)}, 0), 0);
  tell(sample({}, 500), 500);
  sut.forget_old(at(500) + Series::kept);
  EXPECT_EQ(sut.groups(), 1U);
  sut.forget_old(at(501) + Series::kept);
  EXPECT_EQ(sut.groups(), 0U);
  EXPECT_EQ(sut.variables(), 0U);
}

TEST_F(ADataStore, KeepsTheLowestAndTheHighestOfWhatChangesTooFast) {
  const std::vector<double> fast{5, 6, 9, 7, 1, 6, 5};
  for (std::size_t i = 0; i < fast.size(); ++i) {
    const double ms = 1000.0 + static_cast<double>(i) * 10;
    tell(sample({real(fast[i], ms)}, ms), ms);
  }
  const std::vector<std::string> kept = values();
  EXPECT_THAT(kept, SizeIs(Series::most_in_a_grain));
  EXPECT_THAT(kept, testing::Contains("9"));
  EXPECT_THAT(kept, testing::Contains("1"));
  EXPECT_EQ(kept.back(), "5");
}

TEST_F(ADataStore, ForgetsPointsThatAreOldButNotWhatStillHolds) {
  tell(sample({real(1, 0)}, 0), 0);
  tell(sample({real(2, 1000)}, 1000), 1000);
  const double later = 1000 + std::chrono::duration<double, std::milli>(Series::kept).count();
  tell(sample({real(3, later)}, later), later);
  EXPECT_THAT(values(), ElementsAre("2", "3"));
}

TEST_F(ADataStore, SendsAReaderThatHasTheBeginningOnlyTheRest) {
  for (const double value : {1, 2, 3}) {
    tell(sample({real(value, value * 1000)}, value * 1000), value * 1000);
  }
  EXPECT_THAT(values("1/axes/X", at(2000)), ElementsAre("2", "3"));
  EXPECT_EQ(line("1/axes/X", at(2000)).at("whole"), false);
  // The browser knows a value that is not here, so it asked another server before.
  EXPECT_EQ(line("1/axes/X", at(9000)).at("whole"), true);
  EXPECT_THAT(values("1/axes/X", at(9000)), SizeIs(3));
}

TEST_F(ADataStore, StartsOverWhereTheClockWentBack) {
  tell(sample({real(1, 5000)}, 5000), 5000);
  tell(sample({real(2, 6000)}, 6000), 6000);
  tell(sample({real(3, 4000)}, 4000), 6100);
  EXPECT_THAT(values(), ElementsAre("3"));
}

TEST_F(ADataStore, KeepsTheLastTextsAndArrays) {
  const Value array{.name = "A",
                    .type = ValueType::sgn32,
                    .at = at(0),
                    .is_array = true,
                    .elements = std::vector<std::int64_t>{1, 2}};
  tell(sample({text("one", 0), array}, 0), 0);
  tell(sample({text("one", 100), array}, 100), 100);
  tell(sample({text("two", 200), array}, 200), 200);
  const auto changes = line("1/axes/T").at("changes").as_array();
  ASSERT_THAT(changes, SizeIs(2));
  EXPECT_EQ(changes.at(1).at("text"), "\"two\"");
  EXPECT_THAT(values("1/axes/T"), IsEmpty());
  EXPECT_EQ(line("1/axes/A").at("changes").at(0).at("text"), "[1, 2]");
}

TEST_F(ADataStore, HasTheFieldsOfTheCommand) {
  tell(sample({real(1.5, 0), text("\xE4", 0)}, 0), 7);
  const auto samples = sut.samples({.machine = "press"});
  ASSERT_THAT(samples, SizeIs(1));
  EXPECT_EQ(samples.at(0).at("kind"), "data");
  EXPECT_EQ(samples.at(0).at("group"), "axes");
  EXPECT_EQ(samples.at(0).at("wanted_ms"), 100.0);
  EXPECT_EQ(samples.at(0).at("values").at(0).at("value"), 1.5);
  EXPECT_EQ(samples.at(0).at("values").at(1).at("value"), "ä");
  EXPECT_THAT(sut.samples({.machine = "lathe"}), IsEmpty());
  EXPECT_THAT(sut.samples({.channel = 2}), IsEmpty());
  EXPECT_THAT(sut.samples({.group = "other"}), IsEmpty());
}

TEST_F(ADataStore, ShortensALongArray) {
  const Value array{.name = "A",
                    .type = ValueType::sgn32,
                    .is_array = true,
                    .elements = std::vector<std::int64_t>(100, 7)};
  tell(sample({array}, 0), 0);
  const auto value = sut.samples({.most_elements = 16}).at(0).at("values").at(0);
  EXPECT_THAT(value.at("value").as_array(), SizeIs(16));
  EXPECT_EQ(value.at("elements"), 100);
}

TEST_F(ADataStore, KeepsNoMoreThanItHasRoomForAndCountsWhatIsLeftOut) {
  sut =
      DataStore({.groups = 2, .variables = 3, .points = 12, .bytes_of_group = 1000, .bytes = 1500});
  tell(sample({real(1, 0), text("t", 0)}, 0, "one"), 0);
  tell(sample({real(1, 0)}, 0, "two"), 0);
  tell(sample({real(1, 0)}, 0, "three"), 0);
  tell(sample({real(1, 0)}, 100, "three"), 100);
  EXPECT_EQ(sut.groups(), 2U);
  EXPECT_EQ(sut.left_out(), 1U);
  // A group that has grown too large is removed, which makes room.
  tell(sample({text(std::string(2000, 'x'), 0)}, 0, "one"), 0);
  EXPECT_EQ(sut.groups(), 1U);
  tell(sample({real(1, 0)}, 200, "three"), 200);
  EXPECT_EQ(sut.groups(), 2U);
  EXPECT_EQ(sut.left_out(), 1U);
  for (int i = 0; i < 100; ++i) {
    tell(sample({real(i, i * 1000.0)}, i * 1000.0, "two"), i * 1000.0);
  }
  // Each gets an equal share.
  EXPECT_THAT(values("1/two/X"), SizeIs(6));
}

TEST_F(ADataStore, IgnoresImpossibleTimes) {
  for (const auto time : {fabric::Time::max(), fabric::Time::min(), fabric::Time{}}) {
    Value odd = real(1, 0);
    odd.at = time;
    DataSample odd_sample = sample({odd}, 0, "odd");
    odd_sample.at = time;
    tell(odd_sample, 1000);
    tell(DataSample{.key = {"press", 1}, .group = "odd", .at = time}, 2000);
  }
  EXPECT_THAT(values("1/odd/X"), testing::Not(IsEmpty()));
}

TEST_F(ADataStore, RequiresTheWholeNameOfAVariable) {
  tell(sample({real(1, 0)}, 0), 0);
  for (const char* name : {"", "/", "//", "1", "1/axes", "1/axes/", "x/axes/X", "2/axes/X", "1//X",
                           "1/axes/X/", "65536/axes/X", "-1/axes/X"}) {
    EXPECT_THAT(line(name), IsEmpty()) << name;
  }
}

TEST_F(ADataStore, CountsValuesByQuality) {
  tell(sample({real(1, 0), text("t", 0)}, 0), 0);
  tell(sample({real(1, 0, Quality::refused)}, 0, "two"), 0);
  const auto counts = sut.qualities();
  EXPECT_EQ(counts.at({"press", Quality::good}), 2U);
  EXPECT_EQ(counts.at({"press", Quality::refused}), 1U);
}

}  // namespace
}  // namespace millrace::tools::web::plant
