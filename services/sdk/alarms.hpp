// The alarms of a service about itself, apart from its responses: for `millrace services`, `health
// --all`, `doctor`, the page and Prometheus.
//
//   ServiceProgram program({.uuid = "…", .name = "archiver"});
//   program.alarms().raise({.key = {.kind = "archive"}, .text = "… cannot be written: disk full",
//                            .advice = "free space on the disk"});
//   program.alarms().clear("archive", "");
//
// A problem that a response reports to the calling NC program is not an alarm, unless it remains
// after the call.
#pragma once

#include <memory>
#include <string>

#include "fabric/alarm.hpp"

namespace spdlog {
class logger;
}

namespace millrace::services::sdk {

class SharedParticipant;

/// Functions may be called from any thread and return at once. Alarms are stored until the service
/// has joined its fabric.
class Alarms final : public fabric::AlarmSink {
 public:
  Alarms();
  ~Alarms() override;
  Alarms(const Alarms&) = delete;
  Alarms& operator=(const Alarms&) = delete;

  void raise(const fabric::Alarm& alarm) override;
  void clear(const std::string& kind, const std::string& subject) override;

  /// Publishes all alarms, as the instance `who`, until leave().
  void join(const std::shared_ptr<SharedParticipant>& shared, const fabric::InstanceIdentity& who,
            std::shared_ptr<spdlog::logger> log);
  /// Retracts the published alarms, and publishes none from then on.
  void leave();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace millrace::services::sdk
