#include "services/dial_gauge/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/expected_mistakes.hpp"

namespace millrace::services::dial_gauge {
namespace {

using namespace std::chrono_literals;

std::filesystem::path data(const std::string& name) {
  return std::filesystem::path(MILLRACE_TEST_DATA) / "config" / name;
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
