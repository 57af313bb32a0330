#include "services/dial_gauge/simulated_source.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace millrace::services::dial_gauge {
namespace {

using namespace std::chrono_literals;

const Time start = Time{} + 100s;

TEST(SimulatedGauge, ShowsItsNominalValue) {
  SimulatedSource sut({.nominal_mm = {12.345}}, start);
  const auto reading = sut.read(start + 1s);
  ASSERT_TRUE(reading);
  EXPECT_EQ(reading->value, 12'345'000);
  EXPECT_EQ(reading->taken, start + 1s);
}

TEST(SimulatedGauge, MeasuresOnePartAfterTheOther) {
  SimulatedSource sut({.nominal_mm = {1, 2}}, start);
  EXPECT_EQ(sut.read(start)->value, 1'000'000);
  EXPECT_EQ(sut.read(start)->value, 2'000'000);
  EXPECT_EQ(sut.read(start)->value, 1'000'000);
}

TEST(SimulatedGauge, IsTheSameForTheSameSeed) {
  const Simulation simulation{.seed = 42, .nominal_mm = {5}, .noise_um = 10, .resolution_um = 0.1};
  SimulatedSource sut(simulation, start);
  SimulatedSource same(simulation, start);
  Simulation reseeded = simulation;
  reseeded.seed = 43;
  SimulatedSource other(reseeded, start);
  bool differs = false;
  for (int i = 0; i < 20; ++i) {
    const Nanometres value = sut.read(start)->value;
    EXPECT_EQ(same.read(start)->value, value);
    differs |= other.read(start)->value != value;
  }
  EXPECT_TRUE(differs);
}

/// The first value is a literal: it must be the same with every compiler and library.
TEST(SimulatedGauge, IsTheSameOnEveryPlatform) {
  SimulatedSource sut({.seed = 42, .nominal_mm = {5}, .noise_um = 10, .resolution_um = 0.1}, start);
  EXPECT_EQ(sut.read(start)->value, 5'000'200);
}

TEST(SimulatedGauge, ScattersAsConfigured) {
  SimulatedSource sut({.nominal_mm = {5}, .noise_um = 2, .resolution_um = 0.001}, start);
  double sum = 0;
  double squares = 0;
  constexpr int count = 10'000;
  for (int i = 0; i < count; ++i) {
    const double deviation_um = static_cast<double>(sut.read(start)->value - 5'000'000) / 1000;
    sum += deviation_um;
    squares += deviation_um * deviation_um;
  }
  EXPECT_NEAR(sum / count, 0, 0.1);
  EXPECT_NEAR(std::sqrt(squares / count), 2, 0.1);
}

TEST(SimulatedGauge, DriftsWithTime) {
  SimulatedSource sut({.nominal_mm = {5}, .drift_um_per_hour = -6}, start);
  EXPECT_EQ(sut.read(start + 30min)->value, 4'997'000);
}

TEST(SimulatedGauge, ShowsStepsOfItsResolution) {
  SimulatedSource sut({.nominal_mm = {1.2345}, .resolution_um = 10}, start);
  EXPECT_EQ(sut.read(start)->value, 1'230'000);
}

TEST(SimulatedGauge, LosesAsManyReadingsAsConfigured) {
  SimulatedSource sut({.nominal_mm = {5}, .radio_loss_percent = 25}, start);
  int lost = 0;
  for (int i = 0; i < 4000; ++i) {
    const auto reading = sut.read(start);
    lost += reading ? 0 : 1;
    EXPECT_TRUE(reading || reading.error().fault == Fault::no_contact);
  }
  EXPECT_NEAR(lost, 1000, 100);
  EXPECT_EQ(sut.condition().failures, static_cast<std::uint64_t>(lost));
}

TEST(SimulatedGauge, RunsItsBatteryLowAndThenEmpty) {
  SimulatedSource sut({.nominal_mm = {5},
                       .battery_percent = 30,
                       .battery_per_reading_percent = 10,
                       .battery_low_percent = 15},
                      start);
  EXPECT_TRUE(sut.read(start));
  EXPECT_TRUE(sut.read(start));
  EXPECT_EQ(sut.condition().battery_percent, 10U);
  EXPECT_EQ(sut.read(start).error().fault, Fault::battery_low);
  EXPECT_EQ(sut.read(start).error().fault, Fault::no_contact);
  EXPECT_EQ(sut.condition().battery_percent, 0U);
}

}  // namespace
}  // namespace millrace::services::dial_gauge
