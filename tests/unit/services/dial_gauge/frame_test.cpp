#include "services/dial_gauge/frame.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/hex_vectors.hpp"

namespace millrace::services::dial_gauge {
namespace {

using testing::_;
using testing::Each;
using testing::ElementsAre;
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

}  // namespace
}  // namespace millrace::services::dial_gauge
