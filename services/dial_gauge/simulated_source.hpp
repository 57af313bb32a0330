// A simulated dial gauge.
//
//   SimulatedSource gauge({.seed = 7, .nominal_mm = {12.345}, .noise_um = 0.5}, start);
//   gauge.read(now)->value   // 12'345'000 or a step beside it
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "services/dial_gauge/source.hpp"

namespace millrace::services::dial_gauge {

/// Units and meaning: idl/dial_gauge.proto.
struct Simulation {
  std::uint64_t seed = 1;
  /// Not empty.
  std::vector<double> nominal_mm{0.0};
  double noise_um = 0;
  double drift_um_per_hour = 0;
  double resolution_um = 1;
  double radio_loss_percent = 0;
  double battery_percent = 100;
  double battery_per_reading_percent = 0;
  double battery_low_percent = 10;
};

/// The same simulation with reads at the same times returns the same readings, on every platform.
class SimulatedSource : public Source {
 public:
  SimulatedSource(Simulation simulation, Time start);
  tl::expected<Reading, Failure> read(Time now) override;
  [[nodiscard]] Condition condition() const override;

 private:
  /// 0 ≤ x < 1.
  double uniform();
  /// Mean 0, standard deviation 1.
  double normal();

  Simulation simulation_;
  Time start_;
  std::mt19937_64 random_;
  std::size_t part_ = 0;
  double battery_ = 0;
  Condition condition_;
};

}  // namespace millrace::services::dial_gauge
