// What a gateway publishes about a controller besides calls: values of variables, and the starts,
// ends and aborts of NC programs (idl/data.idl).
//
//   DataSample sample{.key = {"press", 1}, .group = "axes"};
//   sample.values.push_back({.name = "V.A.ACT_POS.X", .type = ValueType::real64, …});
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "fabric/messages.hpp"

namespace millrace::fabric {

/// The types of a CNC, with the vendor's numbers.
enum class ValueType : std::uint8_t {
  unknown,
  boolean,
  sgn08,
  uns08,
  sgn16,
  uns16,
  sgn32,
  uns32,
  real64,
  string
};
/// "REAL64", as the vendor writes them; "UNKNOWN".
std::string_view name_of(ValueType type);

/// Good: the value at that time. Stale: the last known value; the controller has not responded
/// since. Refused: the controller refuses to read it.
enum class Quality : std::uint8_t { good, stale, refused };
std::string_view name_of(Quality quality);

/// Booleans (0, 1) and integers; reals; texts in CP1252.
using Elements =
    std::variant<std::vector<std::int64_t>, std::vector<double>, std::vector<std::string>>;
[[nodiscard]] inline std::size_t count(const Elements& elements) {
  return std::visit([](const auto& values) { return values.size(); }, elements);
}

struct Value {
  /// At most 255 bytes.
  std::string name{};
  ValueType type = ValueType::unknown;
  Quality quality = Quality::good;
  /// When the controller reported it; zero = never yet.
  Time at{};
  bool is_array = false;
  Elements elements{};
  /// Why it is not good.
  Message reason{};
  bool operator==(const Value&) const = default;
};
MILLRACE_FIELDS(Value, name, type, quality, at, is_array, (elements, .on_wire = false), reason)

/// The values of one group of one channel, all in each sample. Without values: no gateway publishes
/// the group any more.
struct DataSample {
  ChannelKey key{};
  /// At most 63 bytes.
  std::string group{};
  Time at{};
  /// Between two samples as it was lately, and as it is wanted.
  std::chrono::nanoseconds period{};
  std::chrono::nanoseconds wanted{};
  std::vector<Value> values{};
  bool replayed = false;
  Extras extras{};
  bool operator==(const DataSample&) const = default;
};
MILLRACE_FIELDS(DataSample, (key, .required = true), group, at, period, wanted,
                (values, .proto = "value"), replayed, (extras, .sparse = true))

/// Reset: cancelled while it ran. On hold: in state hold of the CNC, and may continue.
enum class ProgramEventKind : std::uint8_t { started, ended, aborted, reset, on_hold, resumed };
std::string_view name_of(ProgramEventKind kind);

struct ProgramEvent {
  ChannelKey key{};
  ProgramEventKind kind = ProgramEventKind::started;
  Time at{};
  /// When the start of this run was seen; zero if it was not seen.
  Time started{};
  /// In CP1252; empty if no variable for it is configured.
  std::string program{};
  /// The CNC's error; 0 = none, or not known.
  std::uint32_t error = 0;
  /// The counter that the configuration names.
  std::optional<std::int64_t> parts{};
  /// The operation mode; 0 = not known.
  std::uint32_t mode = 0;
  Message detail{};
  bool replayed = false;
  Extras extras{};
  bool operator==(const ProgramEvent&) const = default;
};
MILLRACE_FIELDS(ProgramEvent, (key, .required = true), (kind, .json = "event"), at, started,
                (program, .cp1252 = true), (error, .sparse = true), parts, (mode, .sparse = true),
                detail, replayed, (extras, .sparse = true))

// How a gateway publishes the numbers of a message queue: as machine data, in the group of this
// name under the queue's own key, "press.alarms/1". Its values: last_filled, last_get and elements
// of the controller's structure and array; messages read, answered and waiting, from the journal;
// response and response_state of the last message; array, uuid and drain, as configured.
//
//   if (is_queue(sample)) {
//     if (const auto filled = filled_of(sample)) …          // 3 messages of 99 that have room
//   }

inline constexpr std::string_view queue_group = "queue";

/// The sample comes from another process and may be incomplete.
[[nodiscard]] bool is_queue(const DataSample& sample);
/// Null if there is none of this name.
[[nodiscard]] const Value* value_of(const DataSample& sample, std::string_view name);
/// The last value from the controller or the gateway, of any quality.
[[nodiscard]] std::optional<std::int64_t> number_of(const DataSample& sample,
                                                    std::string_view name);

/// Messages that stand in the controller, and that have room there.
struct Filled {
  std::int64_t messages = 0;
  std::int64_t room = 0;
};
/// Nothing before the first look.
[[nodiscard]] std::optional<Filled> filled_of(const DataSample& sample);

}  // namespace millrace::fabric
