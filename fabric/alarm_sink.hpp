// Where a part of a process reports its faults (fabric/alarm.hpp), independent of how they are
// published.
//
//   sink.raise({.key = {.kind = "archive"}, .text = "… cannot be written: disk full"});
//   sink.clear("archive", "");
#pragma once

#include <string>

#include "fabric/alarm.hpp"

namespace millrace::fabric {

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

/// For parts whose alarms are not published.
class NoAlarms final : public AlarmSink {
 public:
  void raise(const Alarm& /*alarm*/) override {}
  void clear(const std::string& /*kind*/, const std::string& /*subject*/) override {}
};

}  // namespace millrace::fabric
