// The condition that a process publishes about itself: a fault that needs attention, or that it
// runs well.
//
//   Alarm{.kind = "archive", .level = AlarmLevel::problem,
//          .text = "/var/lib/millrace/archive cannot be written: disk full", .advice = "make room
//          on the disk"}
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>

#include "fabric/messages.hpp"

namespace millrace::fabric {

enum class AlarmLevel : std::uint8_t {
  /// The process has no calls and shows with this that it runs.
  fine,
  /// It works, but something needs attention.
  warning,
  /// It does not work, or only in part.
  problem
};

/// "fine", "warning", "problem"; "unknown (200)" for a code of a later version.
std::string_view name_of(AlarmLevel level);

/// The subject of an alarm of one process.
struct AlarmKey {
  /// An instance's id; for other processes a random one, drawn at their start.
  InstanceId responder{};
  /// One word for the kind of alarm, the same in all processes: "archive", "mail_queue". At most 31
  /// bytes.
  std::string kind{};
  /// Which of several of this kind: a gauge, a file. At most 63 bytes.
  std::string subject{};
  auto operator<=>(const AlarmKey&) const = default;
};
MILLRACE_FIELDS(AlarmKey, responder, (kind, .json = "alarm"), subject)

struct Alarm {
  AlarmKey key{};
  AlarmLevel level = AlarmLevel::problem;
  /// The fault and its remedy: one sentence each.
  Message text{};
  Message advice{};
  Time since{};
  /// Name, host and process of the publisher; at most 63 bytes each.
  std::string program{};
  std::string host{};
  std::uint32_t pid = 0;
  Extras extras{};
  bool operator==(const Alarm&) const = default;
};
MILLRACE_FIELDS(Alarm, key, level, text, advice, since, program, host, pid,
                (extras, .sparse = true))

/// `text` shortened to `most` bytes: a longer text ends with " …", and no character is cut in two.
std::string shortened(std::string_view text, std::size_t most);

// Where a part of a process reports its faults (fabric/alarm.hpp), independent of how they are
// published.
//
//   sink.raise({.key = {.kind = "archive"}, .text = "… cannot be written: disk full"});
//   sink.clear("archive", "");

class AlarmSink {
 public:
  virtual ~AlarmSink() = default;
  /// Raises the alarm, or repeats it; `alarm` has kind, subject if there are several, level, text
  /// and advice.
  virtual void raise(const Alarm& alarm) = 0;
  /// Clears the alarm. Without effect if it was not raised.
  virtual void clear(const std::string& kind, const std::string& subject) = 0;

 protected:
  AlarmSink() = default;
  AlarmSink(const AlarmSink&) = default;
  AlarmSink& operator=(const AlarmSink&) = default;
};

}  // namespace millrace::fabric
