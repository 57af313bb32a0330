// The endpoint of a process that publishes alarms about itself, and retracts them.
//
//   AlarmEndpoint alarms(participant, io.get_executor(),
//                     {.key = {.responder = id}, .program = "millrace record", .pid = 17});
//   alarms.raise({.key = {.kind = "recording"}, .level = AlarmLevel::fine, .text = "records"});
//   alarms.clear("recording");
//
// It raises by itself an alarm when the certificate of the process expires soon.
//
// It announces no writer before the first alarm, so a process without alarms costs the fabric
// nothing.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <tl/expected.hpp>

#include "fabric/alarm_table.hpp"
#include "fabric/dds/participant.hpp"

namespace millrace::fabric::endpoints {

/// Use and end it on the executor.
class AlarmEndpoint {
 public:
  /// A process that is silent for this time has no alarms any more: it is gone, or its loop hangs.
  static constexpr std::chrono::milliseconds lease{5000};
  /// How often each alarm is repeated within the lease, so that a reader that missed one gets the
  /// next.
  static constexpr int repeats_per_lease = 4;

  /// `who` has responder, program, host and process. `participant` outlives this object.
  AlarmEndpoint(const dds::Participant& participant, const boost::asio::any_io_executor& executor,
                Alarm who);
  /// Retracts its alarms, unless they were left.
  ~AlarmEndpoint();
  AlarmEndpoint(const AlarmEndpoint&) = delete;
  AlarmEndpoint& operator=(const AlarmEndpoint&) = delete;

  /// Publishes the alarm if it changed. The error is the reason of a failure; the next change tries
  /// again.
  tl::expected<void, std::string> raise(const Alarm& alarm);
  tl::expected<void, std::string> clear(const std::string& kind, const std::string& subject = {});
  /// The process ends because of a fault: readers see that it is gone, with its last alarms.
  void leave_alarms();

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::fabric::endpoints
