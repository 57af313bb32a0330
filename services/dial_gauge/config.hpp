// Reads and checks dial_gauge.textproto (schema and defaults: idl/dial_gauge.proto).
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "services/dial_gauge/answering.hpp"
#include "services/dial_gauge/frame.hpp"
#include "services/dial_gauge/simulated_source.hpp"

namespace millrace::services::dial_gauge {

struct LineConfig {
  std::string name{};
  std::string device{};
  Form form = Form::u_wave;
  unsigned baud_rate = 57600;
  Unit unit = Unit::mm;
  std::chrono::milliseconds reopen{1000};
};

/// A gauge on channel `channel` of line number `line` of the configuration.
struct RadioConfig {
  std::size_t line = 0;
  unsigned channel = 0;
};

struct GaugeConfig {
  Gauge gauge;
  std::variant<Simulation, RadioConfig> source;
};

struct Config {
  std::vector<GaugeConfig> gauges;
  std::vector<LineConfig> lines;
  /// Absolute.
  std::filesystem::path zero_file;
};

/// The error has one line per mistake, with file, line and column.
tl::expected<Config, std::string> load(const std::filesystem::path& file);

/// The configuration without a file: one simulated gauge G1 that shows 12.345 mm, with its zero
/// point stored in `folder`.
Config demonstration(const std::filesystem::path& folder);

// Stores the zero points of the gauges in a file, so that they survive a restart.

/// The zero points of an earlier run; empty if the file does not exist. The error is the fault of
/// the file: the service must not answer with values from an unknown zero point.
tl::expected<Zeros, std::string> read_zeros(const std::filesystem::path& file);

/// Durable once it returns.
tl::expected<void, std::string> keep_zeros(const std::filesystem::path& file, const Zeros& zeros);

}  // namespace millrace::services::dial_gauge
