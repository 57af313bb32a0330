// The running gauges of a configuration: simulators, and receivers on serial lines with a thread
// that reads them.
#pragma once

#include <memory>
#include <string_view>

#include "base/program/log.hpp"
#include "fabric/alarm.hpp"
#include "services/dial_gauge/config.hpp"
#include "services/sdk/response.hpp"

namespace millrace::services::dial_gauge {

class RunningGauges {
 public:
  /// `alarms`, which must outlive it, gets the alarms of lines that are down ("gauge_line") and of
  /// gauges whose requested reading failed ("gauge"). Throws program::UsageError for a file of zero
  /// points that cannot be read.
  RunningGauges(const Config& config, const base::program::Log& log, fabric::AlarmSink& alarms);
  ~RunningGauges();
  RunningGauges(const RunningGauges&) = delete;
  RunningGauges& operator=(const RunningGauges&) = delete;

  /// From any thread.
  sdk::Response answer(std::string_view request);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::dial_gauge
