// Where readings come from: a simulator or a receiver on a serial line.
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
  /// When it was measured, or heard.
  Time taken{};
};

enum class Fault : std::uint8_t {
  /// Nothing has been heard of the gauge, or it does not answer.
  no_contact,
  /// Its battery is too low for a reading to be trusted.
  battery_low,
  /// The receiver itself cannot be reached.
  line_down,
};

struct Failure {
  Fault fault = Fault::no_contact;
  /// In words, for the program's answer.
  std::string reason;
};

/// What a gauge is known to be like, without a reading being taken.
struct Condition {
  std::optional<unsigned> battery_percent{};
  /// Readings had from it, and ones that failed or came broken.
  std::uint64_t readings = 0;
  std::uint64_t failures = 0;
};

/// One gauge. Not thread-safe.
class Source {
 public:
  virtual ~Source() = default;
  /// The newest reading there is; its age is for the caller to judge.
  virtual tl::expected<Reading, Failure> read(Time now) = 0;
  [[nodiscard]] virtual Condition condition() const = 0;
  /// Known without a reading being taken: there is one. Who is not sure says no.
  [[nodiscard]] virtual bool has_reading() const { return false; }
};

}  // namespace millrace::services::dial_gauge
