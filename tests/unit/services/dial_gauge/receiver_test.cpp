#include "services/dial_gauge/receiver.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::services::dial_gauge {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;

class ReceiverTest : public testing::Test {
 protected:
  const Time now = Time{} + 100s;
  Receiver sut{Form::u_wave, Unit::mm};
};

TEST_F(ReceiverTest, CannotBeReachedUntilItsLineIsOpen) {
  EXPECT_EQ(sut.newest(0).error().fault, Fault::line_down);
}

TEST_F(ReceiverTest, HasNoContactToASilentChannel) {
  sut.opened();
  EXPECT_EQ(sut.newest(7).error().fault, Fault::no_contact);
  EXPECT_THAT(sut.newest(7).error().reason, HasSubstr("channel 7"));
}

TEST_F(ReceiverTest, KeepsTheNewestValueOfEachChannel) {
  sut.opened();
  sut.hear("DT10000+00000001.00M\rDT10001+00000002.00M\r", now);
  sut.hear("DT10000+00000003.00M\r", now + 1s);
  EXPECT_EQ(sut.newest(0)->value, 3'000'000);
  EXPECT_EQ(sut.newest(0)->taken, now + 1s);
  EXPECT_EQ(sut.newest(1)->value, 2'000'000);
  EXPECT_EQ(sut.condition(0).readings, 2U);
}

TEST_F(ReceiverTest, ReportsBrokenFramesAndKeepsTheValue) {
  sut.opened();
  sut.hear("DT10000+00000001.00M\r", now);
  EXPECT_THAT(sut.hear("DT10000+0000001.00M\r", now), ElementsAre("DT10000+0000001.00M"));
  EXPECT_EQ(sut.newest(0)->value, 1'000'000);
}

TEST_F(ReceiverTest, ReportsWhyItsLineIsGoneAndKeepsItsValues) {
  sut.opened();
  sut.hear("DT10000+00000001.00M\r", now);
  sut.closed("/dev/ttyUSB0: Input/output error");
  EXPECT_EQ(sut.newest(0).error().reason, "/dev/ttyUSB0: Input/output error");
  sut.opened();
  EXPECT_EQ(sut.newest(0)->taken, now);
}

TEST_F(ReceiverTest, DoesNotJoinTheHalvesOfAnInterruption) {
  sut.opened();
  sut.hear("DT10000+000000", now);
  sut.closed("gone");
  sut.opened();
  sut.hear("11.88M\r", now);
  EXPECT_EQ(sut.newest(0).error().fault, Fault::no_contact);
}

TEST(DigimaticReceiver, HasNoValueWhileTheReceiverReportsAnError) {
  Receiver sut(Form::digimatic, Unit::mm);
  sut.opened();
  sut.hear("01A+0000.123\r911\r", Time{});
  EXPECT_EQ(sut.newest(1).error().fault, Fault::no_contact);
  sut.hear("01A+0000.124\r", Time{});
  EXPECT_EQ(sut.newest(1)->value, 124'000);
  EXPECT_EQ(sut.condition(1).failures, 1U);
}

}  // namespace
}  // namespace millrace::services::dial_gauge
