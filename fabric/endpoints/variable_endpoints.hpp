// The two endpoints of variable requests: a gateway replies, a tool requests.
//
//   VariableReplyEndpoint end(participant, executor, [&](const VariableRequest& request) { … });
//   end.publish(request.requester, reply);
//
//   VariableRequestEndpoint asking(participant, executor, [&](const VariableReply& reply) { … });
//   request.requester = asking.id();
//   if (asking.gateways() > 0) asking.publish(request);
//
// A reply travels in the requester's partition. The replying endpoint creates a writer there at the
// first request, so the first reply waits until DDS has matched it; later ones do not.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <tl/expected.hpp>

#include "fabric/dds/participant.hpp"
#include "fabric/variables.hpp"

namespace millrace::fabric::endpoints {

/// Its handler is called on the executor, one at a time, never from within a function of it.
class VariableReplyEndpoint {
 public:
  /// Largest number of known requesters, of one participant and of all. For a new one, that of them
  /// which was silent for longest is forgotten, and matched again with its next request.
  static constexpr std::size_t most_of_one = 16;
  static constexpr std::size_t most_requesters = 128;
  /// New requesters in 2 s, of one participant and of all: tools have one each. Requests of further
  /// ones are dropped; a tool repeats its request.
  static constexpr std::size_t most_new_of_one = 8;
  static constexpr std::size_t most_new = 32;

  using OnRequest = std::function<void(const VariableRequest&)>;
  /// Gets a line for the log, at most once a minute for each participant.
  using OnIgnored = std::function<void(const std::string&)>;
  /// `participant` outlives it. Throws std::runtime_error with Cyclone's reason.
  VariableReplyEndpoint(const dds::Participant& participant,
                        const boost::asio::any_io_executor& executor, OnRequest on_request,
                        OnIgnored on_ignored);
  ~VariableReplyEndpoint();
  VariableReplyEndpoint(const VariableReplyEndpoint&) = delete;
  VariableReplyEndpoint& operator=(const VariableReplyEndpoint&) = delete;

  /// Fails for a name or reason that is too long, for a requester that is not known, and where DDS
  /// has no room for one more.
  tl::expected<void, std::string> publish(const InstanceId& requester, const VariableReply& reply);
  /// Number of known requesters.
  [[nodiscard]] std::size_t requesters() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Likewise.
class VariableRequestEndpoint {
 public:
  using OnReply = std::function<void(const VariableReply&)>;
  VariableRequestEndpoint(const dds::Participant& participant,
                          const boost::asio::any_io_executor& executor, OnReply on_reply);
  ~VariableRequestEndpoint();
  VariableRequestEndpoint(const VariableRequestEndpoint&) = delete;
  VariableRequestEndpoint& operator=(const VariableRequestEndpoint&) = delete;

  /// The requester id of each request.
  [[nodiscard]] const InstanceId& id() const;
  /// Number of gateways that read requests now.
  [[nodiscard]] std::size_t gateways() const;
  /// A gateway may not receive it, or may end while it works: repeat it with the same token until
  /// the reply is there.
  tl::expected<void, std::string> publish(const VariableRequest& request);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::fabric::endpoints
