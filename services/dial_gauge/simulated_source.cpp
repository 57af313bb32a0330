#include "services/dial_gauge/simulated_source.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <fmt/format.h>

namespace millrace::services::dial_gauge {

namespace {

constexpr double nanometres_per_um = 1000;

}  // namespace

SimulatedSource::SimulatedSource(Simulation simulation, Time start)
    : simulation_(std::move(simulation)),
      start_(start),
      random_(simulation_.seed),
      battery_(simulation_.battery_percent) {
  assert(!simulation_.nominal_mm.empty());
}

tl::expected<Reading, Failure> SimulatedSource::read(Time now) {
  // Each attempt uses the same random numbers and charge, whatever its result, so that a change of
  // one setting does not change all later values.
  const bool lost = uniform() * 100 < simulation_.radio_loss_percent;
  const double noise_um = normal() * simulation_.noise_um;
  const double battery = battery_;
  battery_ = std::max(0.0, battery_ - simulation_.battery_per_reading_percent);
  if (lost || battery <= 0) {
    ++condition_.failures;
    return tl::unexpected(
        Failure{Fault::no_contact, battery <= 0 ? "its battery is empty" : "the radio is silent"});
  }
  if (battery < simulation_.battery_low_percent) {
    ++condition_.failures;
    return tl::unexpected(
        Failure{Fault::battery_low, fmt::format("{:.0f} % of charge left", battery)});
  }
  ++condition_.readings;
  const double nominal_um = simulation_.nominal_mm[part_] * 1000;
  part_ = (part_ + 1) % simulation_.nominal_mm.size();
  const double hours = std::chrono::duration<double, std::ratio<3600>>(now - start_).count();
  const double um = nominal_um + hours * simulation_.drift_um_per_hour + noise_um;
  const Nanometres step = std::llround(simulation_.resolution_um * nanometres_per_um);
  return Reading{.value = quantised(um * nanometres_per_um, step), .taken = now};
}

Condition SimulatedSource::condition() const {
  Condition condition = condition_;
  condition.battery_percent = static_cast<unsigned>(std::lround(battery_));
  return condition;
}

double SimulatedSource::uniform() {
  // 53 random bits; std::uniform_real_distribution differs between libraries.
  return static_cast<double>(random_() >> 11U) * 0x1p-53;
}

double SimulatedSource::normal() {
  // Box-Muller; the argument of log must not be 0.
  const double radius = std::sqrt(-2 * std::log(1 - uniform()));
  return radius * std::cos(2 * M_PI * uniform());
}

}  // namespace millrace::services::dial_gauge
