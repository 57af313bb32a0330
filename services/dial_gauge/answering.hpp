// Answers requests: finds the gauge, judges its reading, and makes the response.
//
// States (docs/reference/services/dial-gauge.md): 1 a value, or what was requested; 10 request not
// understood; 11 unknown gauge; 12 out of range; 13 no radio contact; 14 battery low; 15 value too
// old; 16 receiver not reachable; 17 zero point not kept.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "services/dial_gauge/source.hpp"
#include "services/text/answer.hpp"

namespace millrace::services::dial_gauge {

// The requests of NC programs to gauges.
//
//   parse("READ depth").value() == Request{Verb::read, "depth"}

enum class Verb : std::uint8_t { read, zero, list, status };

struct Request {
  Verb verb = Verb::read;
  /// Empty for `list`.
  std::string gauge;
  /// READ only: the number of millimetres without the unit, as STR_TO_REAL expects it.
  bool bare = false;
  bool operator==(const Request&) const = default;
};

/// READ g, READ g mm, ZERO g, STATUS g or LIST: words separated by blanks, the verb
/// case-insensitive, the name as configured. The error contains what was expected.
tl::expected<Request, std::string> parse(std::string_view text);

inline constexpr std::uint32_t state_unknown_gauge = 11;
inline constexpr std::uint32_t state_out_of_range = 12;
inline constexpr std::uint32_t state_no_contact = 13;
inline constexpr std::uint32_t state_battery_low = 14;
inline constexpr std::uint32_t state_too_old = 15;
inline constexpr std::uint32_t state_line_down = 16;
inline constexpr std::uint32_t state_zero_not_kept = 17;

/// The properties of a gauge, without the source of its values.
struct Gauge {
  std::string name{};
  /// Range of the gauge's own values, without the zero point.
  Nanometres minimum = 0;
  Nanometres maximum = 25 * nanometres_per_mm;
  std::chrono::milliseconds max_age{10000};
  unsigned decimals = 3;
};

/// The value of each gauge at its ZERO.
using Zeros = std::map<std::string, Nanometres>;
/// Stores the zero points for the next start; the error is the reason of a failure.
using SaveZeros = std::function<tl::expected<void, std::string>(const Zeros&)>;

/// Not thread-safe.
class Answering {
 public:
  Answering(Zeros zeros, SaveZeros keep) : zeros_(std::move(zeros)), keep_(std::move(keep)) {}
  void add(Gauge gauge, std::unique_ptr<Source> source);

  sdk::Response answer(std::string_view request, Time now);

  /// The gauges whose last requested reading failed because of gauge, radio or line, with the
  /// reason as text.
  [[nodiscard]] const std::map<std::string, std::string>& failing() const { return failing_; }
  /// Removes gauges from failing() that can be read again, without a request.
  void look();

 private:
  struct Entry {
    Gauge gauge;
    std::unique_ptr<Source> source;
  };

  [[nodiscard]] sdk::Response unknown(const std::string& name) const;
  [[nodiscard]] sdk::Response list() const;
  sdk::Response read(Entry& entry, bool bare, Time now);
  sdk::Response zero(Entry& entry, Time now);
  sdk::Response status(Entry& entry, Time now);
  /// Reads the source, and records whether that was possible.
  tl::expected<Reading, Failure> read_source(Entry& entry, Time now);
  /// The reading if it is usable, otherwise the response with the reason.
  tl::expected<Reading, sdk::Response> good_reading(Entry& entry, Time now);
  [[nodiscard]] Nanometres zero_of(const std::string& gauge) const;

  std::map<std::string, Entry, std::less<>> gauges_;
  Zeros zeros_;
  SaveZeros keep_;
  std::map<std::string, std::string> failing_;
};

}  // namespace millrace::services::dial_gauge
