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
  /// Is so from now on, or is so still; `alarm` names kind, and subject if there are several, and
  /// says level, text and advice.
  virtual void raise(const Alarm& alarm) = 0;
  /// Is not so any more. Nothing happens if it was not.
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
