#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/dial_gauge/answering.hpp"

namespace millrace::services::dial_gauge {
namespace {

using testing::HasSubstr;

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

}  // namespace
}  // namespace millrace::services::dial_gauge
