#include "services/dial_gauge/frame.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/dial_gauge/length.hpp"
#include "services/dial_gauge/receiver.hpp"
#include "tests/support/hex_vectors.hpp"

namespace millrace::services::dial_gauge {
namespace {

using namespace std::chrono_literals;
using testing::_;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using testing::VariantWith;

std::string bytes(const std::string& file, const std::string& vector) {
  const auto raw = tests::hex_vector("dial_gauge/" + file, vector);
  return {raw.begin(), raw.end()};
}

std::vector<Frame> frames(FrameReader& reader, std::string_view bytes) {
  std::vector<Frame> frames;
  reader.feed(bytes, [&](const Frame& frame) { frames.push_back(frame); });
  return frames;
}

std::vector<Frame> u_wave(const std::string& vector) {
  FrameReader sut(Form::u_wave, Unit::mm);
  return frames(sut, bytes("u_wave.hex", vector));
}

std::vector<Frame> digimatic(const std::string& vector, Unit unit = Unit::mm) {
  FrameReader sut(Form::digimatic, unit);
  return frames(sut, bytes("digimatic.hex", vector));
}

const auto broken = VariantWith<BrokenFrame>(_);

Frame value(unsigned channel, Nanometres value) {
  return ValueFrame{channel, value};
}

TEST(UWaveFrame, CarriesChannelAndValueInItsUnit) {
  EXPECT_THAT(u_wave("good"),
              ElementsAre(value(0, 11'880'000), Frame{StateFrame{}}, Frame{StateFrame{}},
                          value(2, -1'000), value(3, 12'700'000)));
}

TEST(UWaveFrame, IsFoundByteByByte) {
  FrameReader sut(Form::u_wave, Unit::mm);
  std::vector<Frame> all;
  for (const char byte : bytes("u_wave.hex", "good")) {
    for (const Frame& frame : frames(sut, {&byte, 1})) {
      all.push_back(frame);
    }
  }
  EXPECT_EQ(all, u_wave("good"));
}

TEST(UWaveFrame, ThatIsATailIsBroken) {
  EXPECT_THAT(u_wave("tail_of_a_frame"), ElementsAre(broken, value(0, 1'500'000)));
}

TEST(UWaveFrame, ThatLostADigitIsBrokenAndNoOtherValue) {
  EXPECT_THAT(u_wave("lost_digit"), ElementsAre(broken));
}

TEST(UWaveFrame, ThatRanIntoTheNextSpoilsItToo) {
  EXPECT_THAT(u_wave("lost_end"), ElementsAre(broken, value(0, 12'000'000)));
}

TEST(UWaveFrame, WithAnythingButAValueIsBroken) {
  EXPECT_THAT(u_wave("bad_characters"), AllOf(SizeIs(6), Each(broken)));
}

TEST(UWaveFrame, WithoutAnEndIsReportedOnceAndPassed) {
  EXPECT_THAT(u_wave("endless"), ElementsAre(broken, value(0, 11'880'000)));
}

TEST(UWaveFrame, MayEndWithALineFeed) {
  EXPECT_THAT(u_wave("line_feeds"), ElementsAre(value(0, 11'880'000), value(0, 11'890'000)));
}

TEST(UWaveFrame, OfBeforeAnInterruptionIsForgotten) {
  FrameReader sut(Form::u_wave, Unit::mm);
  frames(sut, "DT10000+0000");
  sut.reset();
  EXPECT_THAT(frames(sut, "DT10000+00000011.88M\r"), ElementsAre(value(0, 11'880'000)));
}

TEST(DigimaticFrame, CarriesChannelAndValue) {
  EXPECT_THAT(digimatic("good"),
              ElementsAre(value(1, 123'000), value(2, -12'345'000), value(1, 123'450)));
}

TEST(DigimaticFrame, IsInTheConfiguredUnit) {
  EXPECT_EQ(digimatic("good", Unit::inch).at(2), value(1, 3'135'630));
}

TEST(DigimaticFrame, OfAnErrorNamesTheChannel) {
  EXPECT_THAT(digimatic("error"), ElementsAre(Frame{ErrorFrame{.channel = 1, .code = '1'}}));
}

TEST(DigimaticFrame, WithAnythingElseIsBroken) {
  EXPECT_THAT(digimatic("bad"), AllOf(SizeIs(4), Each(broken)));
}

TEST(Length, IsExactInMillimetresAndInches) {
  EXPECT_EQ(parse_length("+00000011.88", Unit::mm), 11'880'000);
  EXPECT_EQ(parse_length("-0000000.001", Unit::mm), -1'000);
  EXPECT_EQ(parse_length("+00.12345", Unit::inch), 3'135'630);
  EXPECT_EQ(parse_length("+1", Unit::mm), 1'000'000);
}

class NoLength : public testing::TestWithParam<std::string_view> {};

TEST_P(NoLength, IsRefused) {
  EXPECT_FALSE(parse_length(GetParam(), Unit::mm));
}

INSTANTIATE_TEST_SUITE_P(Texts, NoLength,
                         testing::Values("", "+", "-.", "1.5", "+1.5 ", " +1.5", "+1,5", "+1.2.3",
                                         "+0x10", "+1e3", "++1", "+nan", "+0.1234567",
                                         "+1234567890123"));

TEST(Length, ThatDoesNotFitIsRefused) {
  EXPECT_FALSE(parse_length("+999999999999", Unit::inch));
}

TEST(Length, IsShownInMillimetresWithItsUnit) {
  EXPECT_EQ(to_text(12'345'000, 3), "12.345 mm");
  EXPECT_EQ(to_text(-1'000, 3), "-0.001 mm");
  EXPECT_EQ(to_text(5'000'000, 0), "5 mm");
  EXPECT_EQ(to_text(1, 6), "0.000001 mm");
}

TEST(Length, IsRoundedHalfAwayFromZero) {
  EXPECT_EQ(to_text(1'500, 3), "0.002 mm");
  EXPECT_EQ(to_text(-1'500, 3), "-0.002 mm");
  EXPECT_EQ(to_text(1'499, 3), "0.001 mm");
}

TEST(Length, HasNoSignIfItRoundsToZero) {
  EXPECT_EQ(to_text(-499, 3), "0.000 mm");
}

TEST(Length, IsQuantisedToTheNearestStep) {
  EXPECT_EQ(quantised(12'345'678.0, 10'000), 12'350'000);
  EXPECT_EQ(quantised(-4'999.0, 10'000), 0);
}

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
