// The endpoint of a service instance: receives its requests, publishes replies.
//
//   ReplyEndpoint end(participant, executor, identity, listener);   // ready as soon as gateways see it
//   end.publish(reply);
#pragma once

#include <memory>
#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <tl/expected.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/messages.hpp"
#include "fabric/request_key.hpp"

namespace millrace::fabric::endpoints {

/// Called one at a time.
class ReplyEndpointListener {
 public:
  virtual ~ReplyEndpointListener() = default;
  /// A request in this instance's partition; repeats are delivered as they come.
  virtual void on_request(const Request& request) = 0;
  /// The gateway's request for the channel was answered, was dispatched to another instance, or its
  /// NC program has withdrawn it. A gateway that ends unexpectedly withdraws nothing: after its
  /// restart it requests the response again.
  virtual void on_withdrawn(const RequestKey& key) = 0;
  /// The requesting gateway is gone, or counts as gone. It, or its successor with the same journal,
  /// may come back for the answer: then its request arrives again.
  virtual void on_orphaned(const RequestKey& key) { static_cast<void>(key); }
  /// A participant requests or withdraws under the call ids of another one, or requests for more
  /// channels than a gateway has; `reason` names it, for the log. At most once a minute for each
  /// participant.
  virtual void on_ignored(const std::string& reason) { static_cast<void>(reason); }
};

/// Publishes the replies of an instance.
class ReplyPublisher {
 public:
  virtual ~ReplyPublisher() = default;
  virtual tl::expected<void, std::string> publish(const Reply& reply) = 0;
};

// With trust, a request for a machine that the requester's certificate does not name is declined
// here, and does not reach the listener; dds::Authenticator::take_warnings() has the message.

/// Where requests are received.
enum class Receiving {
  /// On the executor.
  on_executor,
  /// In the receiving thread, which saves a hand-over: the listener must not block there, nor end
  /// the endpoint. The executor takes bursts (fabric/endpoints/burst.hpp).
  directly
};

/// RAII; use and end it on the executor, which runs one thing at a time and outlives it; in one
/// thread if requests are received directly. Only `publish` and `identity` may be called from any
/// thread while it lives.
class ReplyEndpoint final : public ReplyPublisher {
 public:
  /// Throws std::invalid_argument for an identity that cannot be announced (check_identity), and
  /// std::runtime_error with Cyclone's reason.
  ReplyEndpoint(dds::Participant& participant, const boost::asio::any_io_executor& executor,
                InstanceIdentity identity, ReplyEndpointListener& listener,
                Receiving receiving = Receiving::on_executor);
  ~ReplyEndpoint() override;
  ReplyEndpoint(const ReplyEndpoint&) = delete;
  ReplyEndpoint& operator=(const ReplyEndpoint&) = delete;

  /// Fails for text over 127 bytes and, unless its programs wait for RESPONSE alone, for a final
  /// reply of state 0.
  tl::expected<void, std::string> publish(const Reply& reply) override;
  /// Announced to gateways through discovery; they dispatch no new calls to a draining instance.
  void set_draining(bool draining);
  /// As it was given to the constructor.
  [[nodiscard]] const InstanceIdentity& identity() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::fabric::endpoints
