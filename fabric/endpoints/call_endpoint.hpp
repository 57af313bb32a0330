// The gateway's endpoint on the fabric: publishes requests, takes replies, and knows which
// instances run.
//
//   CallEndpoint end(participant, executor, listener);
//   end.publish(request);                   // to the partition of the instance it is assigned to
//   end.withdraw(key_of(request));
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <tl/expected.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"
#include "fabric/request_key.hpp"

namespace millrace::fabric::endpoints {

/// Called on the executor, one at a time.
class CallEndpointListener {
 public:
  virtual ~CallEndpointListener() = default;
  /// An instance is ready: its request reader and its reply writer are both matched.
  virtual void on_instance_ready(const InstanceIdentity& instance) = 0;
  /// Its user_data changed (draining, channels …).
  virtual void on_instance_changed(const InstanceIdentity& instance) = 0;
  /// It left, or its process has been silent for its lease. A hint, not proof of its end: it may
  /// come back with the same id.
  virtual void on_instance_gone(const InstanceId& instance) = 0;
  /// Repeats are passed on: an endpoint that lost an instance for a moment gets the instance's last
  /// reply on each channel again. The writer of `reply.instance` has sent it; everything else in it
  /// is as the instance, or another DDS, has written it.
  virtual void on_reply(const Reply& reply) = 0;
  /// The load of an instance, from the latest heartbeat of its process, which just arrived.
  virtual void on_load(const InstanceLoad& load) { static_cast<void>(load); }
  /// Whether status of channels and events have readers. Until the first call neither has.
  virtual void on_readers(bool of_channels, bool of_events) {
    static_cast<void>(of_channels);
    static_cast<void>(of_events);
  }
  /// An endpoint looks like an instance's but cannot be one, or uses the id of another instance;
  /// `reason` says which and why, for the log.
  virtual void on_ignored(const std::string& reason) { static_cast<void>(reason); }
};

/// RAII; its functions, its end and the executor's work must not overlap: use it on the executor,
/// which runs one thing at a time and outlives it.
class CallEndpoint {
 public:
  enum class Of : std::uint8_t {
    /// Publishes machines and channels, besides calls and events.
    gateway,
    /// Has no machines.
    tool
  };

  /// Throws std::runtime_error with Cyclone's reason. `listener` is called from the executor only,
  /// never from within a function of this class.
  CallEndpoint(dds::Participant& participant, boost::asio::any_io_executor executor,
               CallEndpointListener& listener, Of of = Of::gateway);
  ~CallEndpoint();
  CallEndpoint(const CallEndpoint&) = delete;
  CallEndpoint& operator=(const CallEndpoint&) = delete;

  /// Publishes the pending call of a channel; replaces the request for the same instance and
  /// channel. Fails for text over 127 bytes, a machine name over 63, and for an instance that was
  /// not discovered. The first one of an executor's turn is sent at once, further ones at the
  /// turn's end: calls that are dispatched together share datagrams. If the instance runs calls at
  /// most once, the status of the channel that was published last goes out first: a gateway that
  /// stands by knows of the call before the instance does.
  tl::expected<void, std::string> publish(const Request& request);
  /// Withdraws the pending call of a channel from an instance: a running handler is notified.
  /// Without effect if there is none. Calls that are not withdrawn stay with the instances when
  /// this endpoint is gone.
  void withdraw(const RequestKey& key);
  /// For observers; an error (a text is too long, a recorder does not keep up) loses one sample.
  /// Only a gateway's endpoint publishes channels and machines. Of several statuses of a channel
  /// within 20 ms observers get the last, and the one at an at-most-once request.
  void publish(const ChannelStatus& status);
  tl::expected<void, std::string> publish(const MachineStatus& status);
  tl::expected<void, std::string> publish(const Event& event);
  /// Asserts that the process of this endpoint runs. If no machine was published and this was not
  /// called for the participant's lease, also because only the executor hangs, readers see its
  /// machines as orphaned, and another gateway takes them over. Then they must be published again.
  void assert_machines();
  /// The channel, or the machine, is not ours any more; another gateway may publish it.
  void unregister(const ChannelKey& key);
  void unregister(const MachineStatus& status);

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::fabric::endpoints
