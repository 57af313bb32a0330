#include <limits>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/bytes.hpp"
#include "gateway/data/group.hpp"
#include "gateway/data/sampler.hpp"

namespace millrace::gateway::data {
namespace {

using namespace std::chrono_literals;
using cnc::ads::ByteWriter;
using cnc::ads::ErrorCode;
using cnc::variables::Bytes;
using cnc::variables::LookupError;
using cnc::variables::Reading;
using cnc::variables::Type;
using fabric::Elements;
using fabric::Quality;
using fabric::Value;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// A controller whose variables are SGN32 numbers, and the time; a test advances both.
class DataSampler : public testing::Test {
 protected:
  void begin(const DataSettings& settings) {
    sut.emplace("press", settings);
    sut->on_up({1, 2}, now.steady);
  }

  static DataSettings one_group(std::vector<std::string> names,
                                std::chrono::milliseconds period = 100ms) {
    return {.groups = {{.name = "axes", .names = std::move(names), .period = period}}};
  }

  void pass(std::chrono::nanoseconds time) {
    now.steady += time;
    now.wall += time;
  }

  /// Carries out the sampler's requests for this time; a response takes `round_trip`.
  void run(std::chrono::nanoseconds time) {
    const SteadyTime end = now.steady + time;
    while (now.steady < end) {
      if (auto step = sut->next(now)) {
        pass(round_trip);
        answer(*step);
      }
      keep_news();
      const auto next = sut->next_time(now.steady);
      const SteadyTime then = std::min(next.value_or(end), end);
      if (then > now.steady) {
        pass(then - now.steady);
      }
    }
  }

  void answer(const Step& step) {
    if (const auto* look_up = std::get_if<Resolve>(&step)) {
      ++look_ups;
      std::vector<Sampler::Resolved> known;
      for (const std::string& name : look_up->names) {
        if (refused.contains(name)) {
          known.emplace_back(
              tl::unexpected(LookupError{refused.at(name), cnc::ads::describe(refused.at(name))}));
        } else {
          known.emplace_back(reading_of(name));
        }
      }
      sut->on_resolved(known, 2, now);
      return;
    }
    const auto& read = std::get<Read>(step);
    reads.push_back(read.readings.size());
    std::vector<Sampler::Answer> answers;
    for (const Reading& reading : read.readings) {
      EXPECT_EQ(reading.port, read.readings.front().port);
      const std::string& name = names.at(reading.index.offset);
      if (refused.contains(name)) {
        answers.emplace_back(tl::unexpected(refused.at(name)));
      } else {
        answers.emplace_back(ByteWriter().u32(static_cast<std::uint32_t>(values[name])).take());
      }
    }
    sut->on_read(answers, with_sums ? 1 : read.readings.size(), with_sums, now);
  }

  Reading reading_of(const std::string& name) {
    const auto offset = static_cast<std::uint32_t>(names.size());
    names[offset] = name;
    Reading reading;
    reading.port = name.starts_with("geo") ? 551 : 552;
    reading.index = {1, offset};
    reading.length = 4;
    reading.type = {Type::sgn32, 4};
    return reading;
  }

  void keep_news() {
    Output output = sut->take_output();
    for (auto& sample : output.samples) {
      samples.push_back(std::move(sample));
    }
    for (auto& line : output.lines) {
      lines.push_back(std::move(line.text));
    }
    for (auto& sample : output.left) {
      left.push_back(sample.group);
    }
  }

  /// The numbers of a sample; -1 for a value without any.
  static std::vector<std::int64_t> numbers(const fabric::DataSample& sample) {
    std::vector<std::int64_t> all;
    for (const fabric::Value& value : sample.values) {
      const auto& elements = std::get<std::vector<std::int64_t>>(value.elements);
      all.push_back(elements.empty() ? -1 : elements.front());
    }
    return all;
  }

  Moment now{SteadyTime(1000s), fabric::Time(2'000'000s)};
  std::chrono::nanoseconds round_trip = 1ms;
  bool with_sums = true;
  std::map<std::string, std::int64_t> values;
  std::map<std::string, ErrorCode> refused;
  std::map<std::uint32_t, std::string> names;
  std::optional<Sampler> sut;
  std::vector<fabric::DataSample> samples;
  std::vector<std::string> lines;
  std::vector<std::string> left;
  std::vector<std::size_t> reads;
  int look_ups = 0;
};

TEST_F(DataSampler, PublishesAllValuesOfAGroupOnceItsControllerAnswers) {
  values = {{"V.E.A", 1}, {"V.E.B", -2}};
  begin(one_group({"V.E.A", "V.E.B"}));

  run(50ms);

  ASSERT_THAT(samples, SizeIs(1));
  EXPECT_EQ(samples[0].key, (fabric::ChannelKey{"press", 1}));
  EXPECT_EQ(samples[0].group, "axes");
  EXPECT_THAT(numbers(samples[0]), ElementsAre(1, -2));
  EXPECT_EQ(samples[0].values[0].quality, Quality::good);
  EXPECT_EQ(samples[0].values[0].at, now.wall - 48ms);
  EXPECT_EQ(samples[0].values[1].type, fabric::ValueType::sgn32);
}

TEST_F(DataSampler, ReadsEachPeriodAndPublishesOnlyChanges) {
  begin(one_group({"V.E.A"}));
  run(950ms);
  EXPECT_THAT(reads, SizeIs(10));
  EXPECT_THAT(samples, SizeIs(1));

  values["V.E.A"] = 7;
  run(100ms);

  ASSERT_THAT(samples, SizeIs(2));
  EXPECT_THAT(numbers(samples[1]), ElementsAre(7));
}

TEST_F(DataSampler, ReadsOnceForAllPeriodsOfAStandstill) {
  begin(one_group({"V.E.A"}));
  run(950ms);
  const std::size_t before = reads.size();
  pass(10 * 100ms);
  run(10ms);
  EXPECT_THAT(reads, SizeIs(before + 1));
  run(200ms);
  EXPECT_THAT(reads, SizeIs(before + 3));
}

TEST_F(DataSampler, PublishesEachPeriodIfConfigured) {
  DataSettings settings = one_group({"V.E.A"});
  settings.groups[0].always = true;
  begin(settings);

  run(950ms);

  EXPECT_THAT(samples, SizeIs(10));
}

TEST_F(DataSampler, ANumberWithinTheDeadbandIsNotPublished) {
  DataSettings settings = one_group({"V.E.A"});
  settings.groups[0].deadband = 2;
  begin(settings);
  run(50ms);
  for (const std::int64_t value : {1, 2, 1, 2}) {
    values["V.E.A"] = value;
    run(100ms);
  }
  EXPECT_THAT(samples, SizeIs(1));

  // Small steps add up: the reference is the last published value, not the last one read.
  values["V.E.A"] = 3;
  run(100ms);

  EXPECT_THAT(samples, SizeIs(2));
}

TEST_F(DataSampler, GroupsOfOnePeriodShareRequests) {
  DataSettings settings = one_group({"V.E.A", "V.E.B"});
  settings.groups.push_back({.name = "more", .channel = 2, .names = {"V.E.C"}, .period = 100ms});
  settings.groups.push_back({.name = "slow", .names = {"V.E.D"}, .period = 200ms});
  begin(settings);

  run(1s);

  EXPECT_THAT(std::vector(reads.begin() + 1, reads.begin() + 5), ElementsAre(3, 4, 3, 4));
}

TEST_F(DataSampler, ARequestReadsAtMostSixtyFourValuesOfOnePort) {
  std::vector<std::string> many;
  for (int i = 0; i < 100; ++i) {
    many.push_back("V.E.N" + std::to_string(i));
  }
  many.emplace_back("geo_mode");
  begin(one_group(many, 1s));

  run(500ms);

  EXPECT_THAT(reads, ElementsAre(64, 36, 1));
  ASSERT_THAT(samples, SizeIs(1));
  EXPECT_THAT(samples[0].values, SizeIs(101));
}

TEST_F(DataSampler, AnUnknownVariableIsRefusedLoggedOnceAndCostsTheOthersNothing) {
  refused["V.E.NO"] = ErrorCode::symbol_not_found;
  refused["V.E.NEITHER"] = ErrorCode::symbol_not_found;
  begin(one_group({"V.E.A", "V.E.NO", "V.E.NEITHER"}));

  run(60s);

  ASSERT_THAT(samples, SizeIs(1));
  EXPECT_EQ(samples[0].values[0].quality, Quality::good);
  EXPECT_EQ(samples[0].values[1].quality, Quality::refused);
  EXPECT_EQ(samples[0].values[1].reason, "0x710 symbol not found");
  ASSERT_THAT(lines, SizeIs(1));
  EXPECT_THAT(lines[0], HasSubstr("press/1: data axes: V.E.NO, V.E.NEITHER cannot be read: 0x710"));
  EXPECT_THAT(reads, SizeIs(testing::Ge(599U)));
}

TEST_F(DataSampler, AGroupThatCannotBeReadIsPublishedAndRetriedLater) {
  refused["V.E.NO"] = ErrorCode::symbol_not_found;
  begin(one_group({"V.E.NO"}));

  run(25s);

  ASSERT_THAT(samples, SizeIs(1));
  EXPECT_EQ(samples[0].values[0].quality, Quality::refused);
  EXPECT_THAT(reads, IsEmpty());
  EXPECT_EQ(look_ups, 3);
}

TEST_F(DataSampler, ANewVariableIsReadOnceItExists) {
  refused["V.P.COUNT"] = ErrorCode::symbol_not_found;
  begin(one_group({"V.P.COUNT"}));
  run(5s);

  refused.clear();
  values["V.P.COUNT"] = 3;
  run(10s);

  ASSERT_THAT(samples, SizeIs(2));
  EXPECT_EQ(samples[1].values[0].quality, Quality::good);
  EXPECT_THAT(numbers(samples[1]), ElementsAre(3));
}

TEST_F(DataSampler, AStaleHandleIsLookedUpAtOnceWithoutALogLine) {
  begin(one_group({"V.E.A"}));
  run(950ms);
  ASSERT_EQ(look_ups, 1);

  refused["V.E.A"] = ErrorCode::invalid_handle;
  const auto step = sut->next({now.steady + 50ms, now.wall});
  ASSERT_TRUE(step);
  answer(*step);
  refused.clear();
  run(300ms);

  EXPECT_EQ(look_ups, 2);
  EXPECT_THAT(lines, IsEmpty());
  EXPECT_EQ(samples.back().values[0].quality, Quality::good);
}

TEST_F(DataSampler, WhatWasGoodIsStaleWhenTheLinkIsDownAndGoodAgainAfterIt) {
  values["V.E.A"] = 5;
  begin(one_group({"V.E.A"}));
  run(50ms);

  sut->on_down("the controller is off", now);
  keep_news();

  ASSERT_THAT(samples, SizeIs(2));
  EXPECT_EQ(samples[1].values[0].quality, Quality::stale);
  EXPECT_EQ(samples[1].values[0].reason, "the controller is off");
  EXPECT_THAT(numbers(samples[1]), ElementsAre(5));
  EXPECT_FALSE(sut->next_time(now.steady));

  sut->on_up({1}, now.steady);
  run(50ms);
  ASSERT_THAT(samples, SizeIs(3));
  EXPECT_EQ(samples[2].values[0].quality, Quality::good);
}

TEST_F(DataSampler, AnAnswerOfALinkThatIsGoneChangesNothing) {
  begin(one_group({"V.E.A"}));
  run(950ms);
  const auto step = sut->next({now.steady + 50ms, now.wall});
  ASSERT_TRUE(step);
  sut->on_down("lost", now);
  keep_news();

  answer(*step);
  keep_news();

  EXPECT_EQ(samples.back().values[0].quality, Quality::stale);
}

TEST_F(DataSampler, OnlyChannelsThatAreServedAreSampled) {
  DataSettings settings = one_group({"V.E.A"});
  settings.groups[0].channel = 3;
  begin(settings);

  run(1s);

  EXPECT_THAT(reads, IsEmpty());
  EXPECT_EQ(look_ups, 0);
}

TEST_F(DataSampler, AReleasedChannelIsNotPublished) {
  begin(one_group({"V.E.A"}));
  run(50ms);

  sut->on_over(1, now);
  values["V.E.A"] = 3;
  run(1s);

  EXPECT_THAT(samples, SizeIs(1));
  EXPECT_THAT(left, ElementsAre("axes"));
}

TEST_F(DataSampler, WhatExceedsTheBudgetIsSampledMoreSlowlyAndLogged) {
  with_sums = false;
  DataSettings settings = one_group({"V.E.A", "V.E.B"});
  settings.requests_per_second = 10;
  begin(settings);

  run(30s);

  // Two requests for each sample: five samples a second of the ten that are configured.
  EXPECT_NEAR(static_cast<double>(reads.size()), 300, 10);
  ASSERT_THAT(lines, SizeIs(1));
  EXPECT_THAT(lines[0], HasSubstr("press/1: data axes: sampled every"));
  EXPECT_THAT(lines[0], HasSubstr("not every 100 ms: the budget of 10 requests a second"));
  EXPECT_GT(samples.back().period, 150ms);
  EXPECT_EQ(samples.back().wanted, 100ms);

  with_sums = true;
  run(30s);

  ASSERT_THAT(lines, SizeIs(2));
  EXPECT_THAT(lines[1], HasSubstr("sampled every 100 ms again"));
  EXPECT_EQ(samples.back().period, 100ms);
}

TEST_F(DataSampler, ThePeriodIsMeasuredAgainAfterTheLinkWasDown) {
  with_sums = false;
  DataSettings settings = one_group({"V.E.A", "V.E.B"});
  settings.requests_per_second = 10;
  begin(settings);
  run(30s);
  ASSERT_GT(samples.back().period, 150ms);

  sut->on_down("the controller is off", now);
  keep_news();

  EXPECT_EQ(samples.back().period, 100ms);
}

TEST_F(DataSampler, WhatIsSampledForSomethingElseIsNamedByThat) {
  refused["V.E.NO"] = ErrorCode::symbol_not_found;
  DataSettings settings = one_group({"V.E.NO"});
  settings.groups[0].name = "/programs";
  begin(settings);

  run(1s);

  ASSERT_THAT(lines, SizeIs(1));
  EXPECT_THAT(lines[0], HasSubstr("press/1: programs: V.E.NO cannot be read"));
}

TEST_F(DataSampler, AShortBudgetIsSharedAmongGroups) {
  with_sums = false;
  DataSettings settings;
  settings.requests_per_second = 10;
  for (const char* name : {"a", "b", "c"}) {
    settings.groups.push_back(
        {.name = name, .names = {std::string("V.E.") + name}, .period = 50ms, .always = true});
  }
  begin(settings);

  run(30s);

  std::map<std::string, int> counts;
  for (const auto& sample : samples) {
    ++counts[sample.group];
  }
  for (const auto& [group, count] : counts) {
    EXPECT_NEAR(count, 100, 15) << group;
  }
  EXPECT_EQ(counts.size(), 3U);
}

TEST_F(DataSampler, AnOverloadedControllerIsNotReadForAWhile) {
  begin(one_group({"V.E.A"}));
  run(50ms);
  refused["V.E.A"] = ErrorCode::mailbox_full;
  run(100ms);
  const std::size_t before = reads.size();

  run(900ms);

  EXPECT_EQ(reads.size(), before);
  EXPECT_EQ(samples.back().values[0].quality, Quality::stale);
}

TEST_F(DataSampler, ASlowControllerIsNamedAsSuch) {
  round_trip = 300ms;
  begin(one_group({"V.E.A"}));

  run(30s);

  ASSERT_THAT(lines, SizeIs(1));
  EXPECT_THAT(lines[0], HasSubstr("the controller responds too slowly"));
}

Reading reading(Type type, std::uint32_t size) {
  Reading reading;
  reading.type = {type, size};
  return reading;
}

Value real(double value) {
  return {.name = "V.E.A", .elements = std::vector<double>{value}};
}

TEST(DataValues, AreDecodedByTheirType) {
  EXPECT_EQ(elements_of(reading(Type::boolean, 1), Bytes{2}),
            Elements(std::vector<std::int64_t>{1}));
  EXPECT_EQ(elements_of(reading(Type::sgn16, 2), Bytes{0xFE, 0xFF, 3, 0}),
            Elements(std::vector<std::int64_t>{-2, 3}));
  EXPECT_EQ(elements_of(reading(Type::real64, 8), Bytes{0, 0, 0, 0, 0, 0, 0xF8, 0x3F}),
            Elements(std::vector<double>{1.5}));
  EXPECT_EQ(elements_of(reading(Type::string, 8), Bytes{'a', 'b', 0, 0}),
            Elements(std::vector<std::string>{"ab"}));
}

TEST(DataValues, AnAnswerThatIsNoSuchValueIsRefusedWithTheReason) {
  const auto wrong = elements_of(reading(Type::real64, 8), Bytes{1, 2, 3});
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error(), "the controller sent 3 bytes for a REAL64 of 8");
}

TEST(DataValues, WhatIsNoNumberIsAChangeOnce) {
  const double no_number = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(is_news(real(1), real(no_number), 0.5));
  EXPECT_FALSE(is_news(real(no_number), real(no_number), 0.5));
}

TEST(DataValues, InfinityIsFurtherThanAnyDeadband) {
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(is_news(real(1), real(infinite), 1e300));
  EXPECT_FALSE(is_news(real(infinite), real(infinite), 0));
  EXPECT_TRUE(is_news(real(-infinite), real(infinite), 1));
}

TEST(DataValues, AnotherQualityReasonOrLengthIsAChange) {
  Value bad = real(1);
  bad.quality = Quality::stale;
  EXPECT_TRUE(is_news(real(1), bad, 10));
  Value why = real(1);
  why.reason = "another one";
  EXPECT_TRUE(is_news(real(1), why, 10));
  Value longer = real(1);
  longer.elements = std::vector<double>{1, 1};
  EXPECT_TRUE(is_news(real(1), longer, 10));
  Value later = real(1);
  later.at = fabric::Time(std::chrono::seconds(1));
  EXPECT_FALSE(is_news(real(1), later, 0));
}

}  // namespace
}  // namespace millrace::gateway::data
