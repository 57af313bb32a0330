// What a service has to say of its own condition besides answering calls, for whoever looks at the
// fabric: `millrace services`, `health --all`, `doctor`, the page, Prometheus.
//
//   ServiceProgram program({.uuid = "…", .name = "archiver"});
//   program.alarms().raise({.key = {.kind = "archive"}, .text = "… cannot be written: disk full",
//                            .advice = "make room on the disk"});
//   program.alarms().clear("archive", "");
//
// A trouble that an answer tells the program that called is none of these, unless it stays when the
// call is over.
#pragma once

#include <memory>
#include <string>

#include "fabric/alarm_sink.hpp"

namespace spdlog {
class logger;
}

namespace millrace::services::sdk {

class SharedParticipant;

/// Functions may be called from any thread, return at once, and remember what they are told while
/// the service is not on its fabric yet.
class Alarms final : public fabric::AlarmSink {
 public:
  Alarms();
  ~Alarms() override;
  Alarms(const Alarms&) = delete;
  Alarms& operator=(const Alarms&) = delete;

  void raise(const fabric::Alarm& alarm) override;
  void clear(const std::string& kind, const std::string& subject) override;

  /// Tells all of it, as the instance `who`, until leave().
  void join(const std::shared_ptr<SharedParticipant>& shared, const fabric::InstanceIdentity& who,
            std::shared_ptr<spdlog::logger> log);
  /// Takes back what was told, and tells nothing any more.
  void leave();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace millrace::services::sdk
