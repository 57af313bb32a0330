#include "services/dial_gauge/config.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include "base/configuration/config_file.hpp"
#include "base/configuration/mistakes.hpp"
#include "base/posix/files.hpp"
#include "idl/dial_gauge.pb.h"

namespace millrace::services::dial_gauge {

namespace {

namespace fs = std::filesystem;
using base::configuration::ConfigPath;
using base::configuration::ConfigStep;
using base::configuration::Mistakes;

/// The longest length of a machine tool in mm; excludes infinity and NaN, which text format
/// accepts.
constexpr double longest = 1e6;

bool is_length(double mm) {
  return std::abs(mm) <= longest;
}

void check(const config::DialGauge::Simulated& simulated, const ConfigPath& path,
           Mistakes& mistakes) {
  mistakes.expect(simulated.nominal_mm_size() > 0, path / "nominal_mm", "is missing");
  for (int i = 0; i < simulated.nominal_mm_size(); ++i) {
    mistakes.expect(is_length(simulated.nominal_mm(i)), path / ConfigStep{"nominal_mm", i},
                    fmt::format("{}; expected a length up to 1000 m", simulated.nominal_mm(i)));
  }
  mistakes.expect_range(simulated.noise_um(), 0.0, longest, path / "noise_um");
  mistakes.expect_range(simulated.drift_um_per_hour(), -longest, longest,
                        path / "drift_um_per_hour");
  mistakes.expect_range(simulated.resolution_um(), 0.001, longest, path / "resolution_um");
  const auto expect_percent = [&](double value, const char* field) {
    mistakes.expect_range(value, 0.0, 100.0, path / field);
  };
  expect_percent(simulated.radio_loss_percent(), "radio_loss_percent");
  expect_percent(simulated.battery_percent(), "battery_percent");
  expect_percent(simulated.battery_per_reading_percent(), "battery_per_reading_percent");
  expect_percent(simulated.battery_low_percent(), "battery_low_percent");
}

std::size_t line_number(const config::DialGauge& from, const std::string& name) {
  const auto found = std::find_if(from.line().begin(), from.line().end(),
                                  [&](const auto& line) { return line.name() == name; });
  return static_cast<std::size_t>(found - from.line().begin());
}

/// The highest channel in a frame of the line; that of the longest frame if the line is missing.
unsigned last_channel(const config::DialGauge& from, const std::string& name) {
  const std::size_t number = line_number(from, name);
  const bool is_digimatic =
      number < static_cast<std::size_t>(from.line_size()) &&
      from.line(static_cast<int>(number)).form() == config::DialGauge::DIGIMATIC;
  return is_digimatic ? 9 : 9999;
}

/// The baud rates of the system (termios).
bool is_baud_rate(unsigned rate) {
  constexpr std::array rates{50U,     75U,     110U,    134U,    150U,    200U,    300U,    600U,
                             1200U,   1800U,   2400U,   4800U,   9600U,   19200U,  38400U,  57600U,
                             115200U, 230400U, 460800U, 500000U, 576000U, 921600U, 1000000U};
  return std::ranges::find(rates, rate) != rates.end();
}

void check_gauges(const config::DialGauge& from, Mistakes& mistakes) {
  std::set<std::string> names;
  for (int i = 0; i < from.gauge_size(); ++i) {
    const config::DialGauge::Gauge& gauge = from.gauge(i);
    const ConfigPath path{{"gauge", i}};
    mistakes.expect(
        is_gauge_name(gauge.name()), path / "name",
        fmt::format("'{}'; expected 1 to 32 letters, digits, '_' or '-'", gauge.name()));
    mistakes.expect(names.insert(gauge.name()).second, path / "name",
                    fmt::format("'{}' occurs twice", gauge.name()));
    mistakes.expect(is_length(gauge.minimum_mm()) && is_length(gauge.maximum_mm()) &&
                        gauge.minimum_mm() < gauge.maximum_mm(),
                    path / "minimum_mm", "is not below maximum_mm");
    mistakes.expect_range(gauge.decimals(), 0U, 6U, path / "decimals");
    mistakes.expect(gauge.max_age_ms() > 0, path / "max_age_ms", "0; expected 1 or more");
    mistakes.expect(gauge.has_simulated() || gauge.has_radio(), path,
                    "has no source; expected simulated or radio");
    if (gauge.has_simulated()) {
      check(gauge.simulated(), path / "simulated", mistakes);
    }
    if (gauge.has_radio()) {
      const std::string& line = gauge.radio().line();
      mistakes.expect(line_number(from, line) < static_cast<std::size_t>(from.line_size()),
                      path / "radio" / "line", fmt::format("the line '{}' does not exist", line));
      if (mistakes.expect(gauge.radio().has_channel(), path / "radio" / "channel", "is missing")) {
        mistakes.expect_range(gauge.radio().channel(), 0U, last_channel(from, line),
                              path / "radio" / "channel");
      }
    }
  }
}

void check_lines(const config::DialGauge& from, Mistakes& mistakes) {
  std::set<std::string> names;
  for (int i = 0; i < from.line_size(); ++i) {
    const config::DialGauge::Line& line = from.line(i);
    const ConfigPath path{{"line", i}};
    mistakes.expect(!line.name().empty(), path / "name", "is missing");
    mistakes.expect(names.insert(line.name()).second, path / "name",
                    fmt::format("'{}' occurs twice", line.name()));
    mistakes.expect(!line.device().empty(), path / "device", "is missing");
    mistakes.expect(!line.has_baud_rate() || is_baud_rate(line.baud_rate()), path / "baud_rate",
                    fmt::format("{}; expected a rate of serial lines, such as 9600 or 57600",
                                line.baud_rate()));
    mistakes.expect(line.reopen_ms() > 0, path / "reopen_ms", "0; expected 1 or more");
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
  config::DialGauge from;
  base::configuration::ConfigPlaces places;
  if (const auto read = base::configuration::read_config(file, from, places); !read) {
    return tl::unexpected(read.error());
  }
  Mistakes mistakes(from, places);
  check_gauges(from, mistakes);
  check_lines(from, mistakes);
  if (!mistakes.none()) {
    return tl::unexpected(mistakes.text());
  }
  Config config;
  for (const auto& gauge : from.gauge()) {
    config.gauges.push_back(gauge_config(from, gauge));
  }
  for (const auto& line : from.line()) {
    config.lines.push_back(line_config(line));
  }
  config.zero_file = fs::absolute(file).parent_path() / from.zero_file();
  return config;
}

Config demonstration(const fs::path& folder) {
  Config config;
  config.gauges.push_back(
      {.gauge = {.name = "G1"}, .source = Simulation{.nominal_mm = {12.345}, .noise_um = 0.5}});
  config.zero_file = folder / config::DialGauge().zero_file();
  return config;
}

tl::expected<Zeros, std::string> read_zeros(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    return Zeros{};
  }
  const auto from = base::configuration::read_config<config::DialGaugeZeros>(file);
  if (!from) {
    return tl::unexpected(from.error());
  }
  Zeros zeros;
  for (const auto& zero : from->zero()) {
    zeros[zero.gauge()] = zero.nanometres();
  }
  return zeros;
}

tl::expected<void, std::string> keep_zeros(const std::filesystem::path& file, const Zeros& zeros) {
  config::DialGaugeZeros to;
  for (const auto& [gauge, nanometres] : zeros) {
    auto* const zero = to.add_zero();
    zero->set_gauge(gauge);
    zero->set_nanometres(nanometres);
  }
  std::string text;
  google::protobuf::TextFormat::PrintToString(to, &text);
  return base::posix::write_durably(file, "# The zero points set by ZERO.\n" + text);
}

}  // namespace millrace::services::dial_gauge
