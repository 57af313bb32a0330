#include "cnc/ads/signs_of_life.hpp"

#include <gtest/gtest.h>

namespace millrace::cnc::ads {
namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t cnc = 552;
constexpr std::uint16_t plc = 851;
constexpr auto port_not_found = ErrorCode::target_port_not_found;

SignsOfLife::Time at(std::chrono::milliseconds time) {
  return SignsOfLife::Time(100s) + time;
}

class TheSignsOfLife : public testing::Test {
 protected:
  TheSignsOfLife() { sut.begin(at(0s)); }
  SignsOfLife sut{cnc, 2s};
};

TEST_F(TheSignsOfLife, BeginWithTheConnection) {
  EXPECT_EQ(sut.silent_for(at(3s)), 3s);
  EXPECT_EQ(sut.late_for(at(3s)), 3s);
  EXPECT_FALSE(sut.refused(at(3s)));
}

TEST_F(TheSignsOfLife, CountALateResponseForSilenceOnly) {
  sut.answered(cnc, false, at(1s));
  EXPECT_EQ(sut.silent_for(at(3s)), 2s);
  EXPECT_EQ(sut.late_for(at(3s)), 3s);
}

TEST_F(TheSignsOfLife, EndWhenTheRouterHasDeliveredNothingForATimeout) {
  sut.not_delivered(cnc, ErrorCode::target_machine_not_found, at(10s));
  EXPECT_FALSE(sut.refused(at(10s))) << "also after a long time without requests";
  sut.not_delivered(cnc, port_not_found, at(12s));
  EXPECT_FALSE(sut.refused(at(12s - 1ms)));
  ASSERT_TRUE(sut.refused(at(12s)));
  EXPECT_EQ(sut.refused(at(12s))->error, port_not_found);
  EXPECT_EQ(sut.refused(at(12s))->since, at(10s));
}

TEST_F(TheSignsOfLife, ForgetTheRefusalsWhenTheCncAnswers) {
  sut.not_delivered(cnc, port_not_found, at(1s));
  sut.answered(cnc, true, at(2s));
  sut.not_delivered(cnc, port_not_found, at(3s));
  EXPECT_FALSE(sut.refused(at(4s)));
  EXPECT_TRUE(sut.refused(at(5s)));
}

TEST_F(TheSignsOfLife, ForgetThemInTheNextConnection) {
  sut.not_delivered(cnc, port_not_found, at(1s));
  sut.begin(at(2s));
  EXPECT_FALSE(sut.refused(at(9s)));
}

TEST_F(TheSignsOfLife, LetAPlcNeitherProveNorDisproveThatTheCncRuns) {
  sut.not_delivered(plc, port_not_found, at(1s));
  EXPECT_FALSE(sut.refused(at(9s)));
  sut.not_delivered(cnc, port_not_found, at(10s));
  sut.answered(plc, true, at(11s));
  EXPECT_TRUE(sut.refused(at(12s)));
}

}  // namespace
}  // namespace millrace::cnc::ads
