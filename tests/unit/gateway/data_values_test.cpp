#include <limits>

#include <gtest/gtest.h>

#include "gateway/data/group.hpp"

namespace millrace::gateway::data {
namespace {

using cnc::variables::Bytes;
using cnc::variables::Reading;
using cnc::variables::Type;
using fabric::Elements;
using fabric::Quality;
using fabric::Value;

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
