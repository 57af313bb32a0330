#include "services/dial_gauge/config.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <google/protobuf/text_format.h>

#include "base/configuration/check.hpp"
#include "base/posix/files.hpp"
#include "idl/dial_gauge.pb.h"

namespace millrace::services::dial_gauge {

namespace {

namespace fs = std::filesystem;
using base::configuration::ConfigPath;
using base::configuration::Mistakes;

std::size_t line_number(const config::DialGauge& from, const std::string& name) {
  const auto found = std::find_if(from.line().begin(), from.line().end(),
                                  [&](const auto& line) { return line.name() == name; });
  return static_cast<std::size_t>(found - from.line().begin());
}

/// The baud rates of the system (termios).
bool is_baud_rate(unsigned rate) {
  constexpr std::array rates{50U,     75U,     110U,    134U,    150U,    200U,    300U,    600U,
                             1200U,   1800U,   2400U,   4800U,   9600U,   19200U,  38400U,  57600U,
                             115200U, 230400U, 460800U, 500000U, 576000U, 921600U, 1000000U};
  return std::ranges::find(rates, rate) != rates.end();
}

void check_sources(const config::DialGauge& from, Mistakes& mistakes) {
  constexpr std::uint32_t last_channel_of_digimatic = 9;
  for (int i = 0; i < from.gauge_size(); ++i) {
    const config::DialGauge::Gauge& gauge = from.gauge(i);
    const ConfigPath path{{"gauge", i}};
    mistakes.expect(gauge.minimum_mm() < gauge.maximum_mm(), path / "minimum_mm",
                    "is not below maximum_mm");
    mistakes.expect(gauge.has_simulated() || gauge.has_radio(), path,
                    "has no source; expected simulated or radio");
    if (gauge.has_radio()) {
      const config::DialGauge::Radio& radio = gauge.radio();
      const std::size_t number = line_number(from, radio.line());
      if (mistakes.expect(number < static_cast<std::size_t>(from.line_size()),
                          path / "radio" / "line",
                          fmt::format("the line '{}' does not exist", radio.line())) &&
          from.line(static_cast<int>(number)).form() == config::DialGauge::DIGIMATIC) {
        mistakes.expect_range(radio.channel(), 0U, last_channel_of_digimatic,
                              path / "radio" / "channel");
      }
    }
  }
  for (int i = 0; i < from.line_size(); ++i) {
    const config::DialGauge::Line& line = from.line(i);
    mistakes.expect(!line.has_baud_rate() || is_baud_rate(line.baud_rate()),
                    {{"line", i}, {"baud_rate"}},
                    fmt::format("{}; expected a rate of serial lines, such as 9600 or 57600",
                                line.baud_rate()));
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
          .unit = from.unit() == config::DialGauge::INCH ? Unit::inch : Unit::mm};
}

}  // namespace

tl::expected<Config, std::string> load(const fs::path& file) {
  return base::configuration::load<config::DialGauge>(
      file, [&](const config::DialGauge& from, Mistakes& mistakes) {
        check_sources(from, mistakes);
        Config config;
        for (const auto& gauge : from.gauge()) {
          config.gauges.push_back(gauge_config(from, gauge));
        }
        for (const auto& line : from.line()) {
          config.lines.push_back(line_config(line));
        }
        config.zero_file = fs::absolute(file).parent_path() / from.zero_file();
        return config;
      });
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
