// The gateway's alarms about its certificates for Secure ADS, and about services whose last
// instance disappeared without leaving, or whose responses are errors.
#pragma once

#include <chrono>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/program/log.hpp"
#include "fabric/alarm.hpp"
#include "fabric/endpoints/alarm_endpoint.hpp"
#include "fabric/log_limiter.hpp"
#include "fabric/messages.hpp"
#include "gateway/core/service_faults.hpp"
#include "gateway/moment.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::shell {

/// One for each certificate, whatever the number of its machines; its subject stays the same.
std::vector<fabric::Alarm> certificate_alarms(
    const std::vector<settings::MachineSettings>& machines, std::chrono::sys_seconds now);

class GatewayAlarms {
 public:
  /// `endpoint` outlives this.
  GatewayAlarms(fabric::endpoints::AlarmEndpoint& endpoint, base::program::Log log)
      : endpoint_(endpoint), log_(std::move(log)) {}

  /// Now, and again as they near their expiry.
  void publish_certificates(const std::vector<settings::MachineSettings>& machines, Moment now);

  // Services. Which of their instances come and go is logged, too.
  /// An instance came; or its identity has changed (`is_new` is false).
  void on_ready(const fabric::InstanceIdentity& instance, bool is_new, Moment now);
  void on_gone(const fabric::InstanceId& instance, Moment now);
  /// A final reply to a channel of this gateway.
  void on_response(const fabric::Reply& reply, Moment now);
  void on_time(Moment now);

 private:
  fabric::endpoints::AlarmEndpoint& endpoint_;
  base::program::Log log_;
  /// The last published alarm of each certificate, by its subject.
  std::map<std::string, fabric::Alarm> certificates_;
  core::LostServices lost_;
  core::ErrorSeries errors_;
  fabric::Throttle lines_{1000, std::chrono::seconds(10)};
};

}  // namespace millrace::gateway::shell
