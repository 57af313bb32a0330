// The answering of requests: which gauge, is its reading good, and what does the program get.
//
// States (docs/services.md): 1 a value, or what was asked for; 10 request not understood; 11
// unknown gauge; 12 out of range; 13 no radio contact; 14 battery low; 15 value too old; 16
// receiver not reachable; 17 zero point not kept.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "services/dial_gauge/request.hpp"
#include "services/dial_gauge/source.hpp"
#include "services/text/answer.hpp"

namespace millrace::services::dial_gauge {

inline constexpr std::uint32_t state_unknown_gauge = 11;
inline constexpr std::uint32_t state_out_of_range = 12;
inline constexpr std::uint32_t state_no_contact = 13;
inline constexpr std::uint32_t state_battery_low = 14;
inline constexpr std::uint32_t state_too_old = 15;
inline constexpr std::uint32_t state_line_down = 16;
inline constexpr std::uint32_t state_zero_not_kept = 17;

/// What is known of a gauge beside where its values come from.
struct Gauge {
  std::string name{};
  /// Of what the gauge shows, before ZERO.
  Nanometres minimum = 0;
  Nanometres maximum = 25 * nanometres_per_mm;
  std::chrono::milliseconds max_age{10000};
  unsigned decimals = 3;
};

/// What each gauge showed when it was zeroed.
using Zeros = std::map<std::string, Nanometres>;
/// Keeps them where a restart finds them; the error says why that failed.
using KeepZeros = std::function<tl::expected<void, std::string>(const Zeros&)>;

/// Not thread-safe.
class Answering {
 public:
  Answering(Zeros zeros, KeepZeros keep) : zeros_(std::move(zeros)), keep_(std::move(keep)) {}
  void add(Gauge gauge, std::unique_ptr<Source> source);

  sdk::Response answer(std::string_view request, Time now);

  /// The gauges of which a program could not have a reading when it asked last, because of gauge,
  /// radio or line, and why in words.
  [[nodiscard]] const std::map<std::string, std::string>& failing() const { return failing_; }
  /// Forgets those that can be read again, although no program has asked.
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
  /// Reads the source, and remembers whether that is possible.
  tl::expected<Reading, Failure> read_source(Entry& entry, Time now);
  /// The reading, if it is one to work with, else the answer that says why not.
  tl::expected<Reading, sdk::Response> good_reading(Entry& entry, Time now);
  [[nodiscard]] Nanometres zero_of(const std::string& gauge) const;

  std::map<std::string, Entry, std::less<>> gauges_;
  Zeros zeros_;
  KeepZeros keep_;
  std::map<std::string, std::string> failing_;
};

}  // namespace millrace::services::dial_gauge
