// The sources of readings: a simulator or a receiver on a serial line.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "services/dial_gauge/length.hpp"

namespace millrace::services::dial_gauge {

using Time = std::chrono::steady_clock::time_point;

struct Reading {
  Nanometres value = 0;
  /// When it was measured or received.
  Time taken{};
};

enum class Fault : std::uint8_t {
  /// No value of the gauge was received, or it does not answer.
  no_contact,
  /// Its battery is too low for a reliable reading.
  battery_low,
  /// The receiver itself cannot be reached.
  line_down,
};

struct Failure {
  Fault fault = Fault::no_contact;
  /// As text, for the response.
  std::string reason;
};

/// What is known about a gauge without a reading.
struct Condition {
  std::optional<unsigned> battery_percent{};
  /// Received readings, and failed or broken ones.
  std::uint64_t readings = 0;
  std::uint64_t failures = 0;
};

/// One gauge. Not thread-safe.
class Source {
 public:
  virtual ~Source() = default;
  /// The newest reading; the caller judges its age.
  virtual tl::expected<Reading, Failure> read(Time now) = 0;
  [[nodiscard]] virtual Condition condition() const = 0;
  /// True if a reading is available without measuring. False if that is not known.
  [[nodiscard]] virtual bool has_reading() const { return false; }
};

}  // namespace millrace::services::dial_gauge
