// One running instance of a service: keeps it on the fabric, as part of its participant, and
// returns its calls. Service and the C interface use it on their threads.
//
//   Instance instance(options, log);
//   while (const auto call = instance.next()) call->answer(…);
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"
#include "services/sdk/call_scheduler.hpp"
#include "services/sdk/service.hpp"

namespace millrace::services::sdk {

/// The participant options of a service with these options.
fabric::dds::ParticipantOptions join_options(const ServiceOptions& options);

/// The scheduler's options of an instance of it. Throws std::invalid_argument for an error state of
/// 0 and too many concurrent calls.
CallSchedulerOptions scheduler_options(const ServiceOptions& options,
                                       const fabric::InstanceId& instance,
                                       bool authenticated_requesters);

/// For an instance whose calls run in another process: next() returns none of them. Called in any
/// thread, in order, except for calls that are cancelled as they begin; must not block, nor end the
/// instance.
struct InstanceCallbacks {
  /// The receiver of a call must answer it, also a cancelled one: until then the call counts as
  /// running.
  AsyncHandler call;
  /// No requester waits for this call any more; it may not have begun.
  std::function<void(fabric::CallId)> cancelled;
  /// An operator commands the instance to leave; see HostedInstance::on_drain.
  std::function<void(const std::string& issuer)> draining;
};

class Instance {
 public:
  /// Throws as Service does. Calls wait for next(), unless `inline_handler` runs them; see
  /// ServiceOptions::run_inline.
  Instance(const ServiceOptions& options, const Service::Log& log,
           AsyncHandler inline_handler = nullptr);
  Instance(const ServiceOptions& options, const Service::Log& log, InstanceCallbacks callbacks);
  /// Leaves.
  ~Instance();
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  [[nodiscard]] const fabric::InstanceIdentity& identity() const;

  /// Waits for a call to run. Null once the instance has drained. From any thread.
  std::shared_ptr<const Call> next();
  /// The same, but null too when `limit` is over.
  std::shared_ptr<const Call> next_for(std::chrono::milliseconds limit);

  /// Accepts no new call from gateways. Calls that they dispatched before they noticed are still
  /// run; when the last call is answered, next() ends. From any thread, returns at once.
  void drain();

  /// True once next() has ended.
  [[nodiscard]] bool drained() const;

  /// Leaves the fabric without waiting for running calls; their answers are dropped. Not from
  /// several threads at once.
  void leave();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// A summary of an instance's calls, for a log that does not list each. Pure.
//
//   if (auto line = call_summary(before, now, 60s)) log->info(*line);

/// The activity of the instance between these two, `span` apart; nullopt if no call came and none
/// ended.
std::optional<std::string> call_summary(const fabric::InstanceStatus& before,
                                        const fabric::InstanceStatus& now,
                                        std::chrono::seconds span);

}  // namespace millrace::services::sdk
