#include "services/dial_gauge/config.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "base/configuration/config_file.hpp"
#include "idl/dial_gauge.pb.h"

namespace millrace::services::dial_gauge {

namespace {

namespace fs = std::filesystem;

/// Collects mistakes, each with its place.
class Checker {
 public:
  explicit Checker(std::string file) : file_(std::move(file)) {}
  void expect(bool holds, const std::string& place, const std::string& mistake) {
    if (!holds) {
      text_ += fmt::format("{}{}: {}: {}", text_.empty() ? "" : "\n", file_, place, mistake);
    }
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string file_;
  std::string text_;
};

/// A length of a machine tool, and no infinity or NaN, which text format lets pass.
bool is_length(double mm) {
  return std::isfinite(mm) && std::abs(mm) <= 1e6;
}
bool is_percent(double value) {
  return value >= 0 && value <= 100;
}

void check(const config::DialGauge::Simulated& simulated, const std::string& place,
           Checker& checker) {
  checker.expect(simulated.nominal_mm_size() > 0, place, "nominal_mm is missing");
  checker.expect(
      std::all_of(simulated.nominal_mm().begin(), simulated.nominal_mm().end(), is_length), place,
      "nominal_mm is no length up to 1000 m");
  checker.expect(is_length(simulated.noise_um()) && simulated.noise_um() >= 0, place,
                 "noise_um is negative");
  checker.expect(is_length(simulated.drift_um_per_hour()), place, "drift_um_per_hour is no number");
  checker.expect(simulated.resolution_um() >= 0.001 && is_length(simulated.resolution_um()), place,
                 "resolution_um is below 0.001");
  checker.expect(is_percent(simulated.radio_loss_percent()) &&
                     is_percent(simulated.battery_percent()) &&
                     is_percent(simulated.battery_per_reading_percent()) &&
                     is_percent(simulated.battery_low_percent()),
                 place, "a percentage is outside 0 to 100");
}

std::size_t line_number(const config::DialGauge& from, const std::string& name) {
  const auto found = std::find_if(from.line().begin(), from.line().end(),
                                  [&](const auto& line) { return line.name() == name; });
  return static_cast<std::size_t>(found - from.line().begin());
}

void check_gauges(const config::DialGauge& from, Checker& checker) {
  std::set<std::string> names;
  for (const auto& gauge : from.gauge()) {
    const std::string place = "gauge '" + gauge.name() + "'";
    checker.expect(is_gauge_name(gauge.name()), place,
                   "name is not 1 to 32 letters, digits, '_' or '-'");
    checker.expect(names.insert(gauge.name()).second, place, "is there twice");
    checker.expect(is_length(gauge.minimum_mm()) && is_length(gauge.maximum_mm()) &&
                       gauge.minimum_mm() < gauge.maximum_mm(),
                   place, "minimum_mm is not below maximum_mm");
    checker.expect(gauge.decimals() <= 6, place, "decimals is more than 6");
    checker.expect(gauge.has_simulated() || gauge.has_radio(), place,
                   "source is missing: expected simulated or radio");
    if (gauge.has_simulated()) {
      check(gauge.simulated(), place, checker);
    }
    if (gauge.has_radio()) {
      checker.expect(
          line_number(from, gauge.radio().line()) < static_cast<std::size_t>(from.line_size()),
          place, "there is no line '" + gauge.radio().line() + "'");
      checker.expect(gauge.radio().has_channel(), place, "channel is missing");
    }
  }
}

void check_lines(const config::DialGauge& from, Checker& checker) {
  std::set<std::string> names;
  for (const auto& line : from.line()) {
    const std::string place = "line '" + line.name() + "'";
    checker.expect(!line.name().empty(), place, "name is missing");
    checker.expect(names.insert(line.name()).second, place, "is there twice");
    checker.expect(!line.device().empty(), place, "device is missing");
    checker.expect(line.reopen_ms() > 0, place, "reopen_ms is 0; expected 1 or more");
  }
}

Nanometres length(double mm) {
  return std::llround(mm * static_cast<double>(nanometres_per_mm));
}

Simulation simulation(const config::DialGauge::Simulated& from) {
  return {.seed = from.seed(),
          .nominal_mm = {from.nominal_mm().begin(), from.nominal_mm().end()},
          .noise_um = from.noise_um(),
          .drift_um_per_hour = from.drift_um_per_hour(),
          .resolution_um = from.resolution_um(),
          .radio_loss_percent = from.radio_loss_percent(),
          .battery_percent = from.battery_percent(),
          .battery_per_reading_percent = from.battery_per_reading_percent(),
          .battery_low_percent = from.battery_low_percent()};
}

GaugeConfig gauge_config(const config::DialGauge& all, const config::DialGauge::Gauge& from) {
  GaugeConfig gauge{.gauge = {.name = from.name(),
                              .minimum = length(from.minimum_mm()),
                              .maximum = length(from.maximum_mm()),
                              .max_age = std::chrono::milliseconds(from.max_age_ms()),
                              .decimals = from.decimals()},
                    .source = {}};
  if (from.has_radio()) {
    gauge.source = RadioConfig{.line = line_number(all, from.radio().line()),
                               .channel = from.radio().channel()};
  } else {
    gauge.source = simulation(from.simulated());
  }
  return gauge;
}

LineConfig line_config(const config::DialGauge::Line& from) {
  const Form form = from.form() == config::DialGauge::DIGIMATIC ? Form::digimatic : Form::u_wave;
  const unsigned usual_baud_rate = form == Form::digimatic ? 9600 : 57600;
  return {.name = from.name(),
          .device = from.device(),
          .form = form,
          .baud_rate = from.has_baud_rate() ? from.baud_rate() : usual_baud_rate,
          .unit = from.unit() == config::DialGauge::INCH ? Unit::inch : Unit::mm,
          .reopen = std::chrono::milliseconds(from.reopen_ms())};
}

}  // namespace

tl::expected<Config, std::string> load(const fs::path& file) {
  const auto from = base::configuration::read_config<config::DialGauge>(file);
  if (!from) {
    return tl::unexpected(from.error());
  }
  Checker checker(file.string());
  check_gauges(*from, checker);
  check_lines(*from, checker);
  if (!checker.text().empty()) {
    return tl::unexpected(checker.text());
  }
  Config config;
  for (const auto& gauge : from->gauge()) {
    config.gauges.push_back(gauge_config(*from, gauge));
  }
  for (const auto& line : from->line()) {
    config.lines.push_back(line_config(line));
  }
  config.zero_file = fs::absolute(file).parent_path() / from->zero_file();
  return config;
}

Config demonstration(const fs::path& folder) {
  Config config;
  config.gauges.push_back(
      {.gauge = {.name = "G1"}, .source = Simulation{.nominal_mm = {12.345}, .noise_um = 0.5}});
  config.zero_file = folder / config::DialGauge().zero_file();
  return config;
}

}  // namespace millrace::services::dial_gauge
