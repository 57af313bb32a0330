// The end of a program that says something of itself: troubles that it has, and that they are over.
//
//   AlarmEndpoint alarms(participant, io.get_executor(),
//                     {.key = {.responder = id}, .program = "millrace record", .pid = 17});
//   alarms.raise({.key = {.kind = "recording"}, .level = AlarmLevel::fine, .text = "records"});
//   alarms.clear("recording");
//
// Of itself it says that the certificate which the program shows ends soon.
//
// It announces no writer before there is something to say, so a program that is well costs the
// fabric nothing.
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
  /// A program that is silent for so long has no alarms any more: it is gone, or its loop hangs.
  static constexpr std::chrono::milliseconds lease{5000};
  /// Each alarm is said so often in the lease, so that who took it for gone hears it again.
  static constexpr int repeats_per_lease = 4;

  /// `who` has responder, program, host and process. `participant` outlives it.
  AlarmEndpoint(const dds::Participant& participant, const boost::asio::any_io_executor& executor,
                Alarm who);
  /// Takes back what it has said.
  ~AlarmEndpoint();
  AlarmEndpoint(const AlarmEndpoint&) = delete;
  AlarmEndpoint& operator=(const AlarmEndpoint&) = delete;

  /// Says it, if it is new. The error says why nobody is told; it is tried again with the next one.
  tl::expected<void, std::string> raise(const Alarm& alarm);
  tl::expected<void, std::string> clear(const std::string& kind, const std::string& subject = {});

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::fabric::endpoints
