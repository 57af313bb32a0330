// The two endpoints of questions about variables: who answers, a gateway, and who asks.
//
//   VariableReplyEndpoint end(participant, executor, [&](const VariableRequest& request) { … });
//   end.publish(request.requester, reply);
//
//   VariableRequestEndpoint asking(participant, executor, [&](const VariableReply& reply) { … });
//   request.requester = asking.id();
//   if (asking.gateways() > 0) asking.publish(request);
//
// A reply travels in a partition of who asks, whom the answering end meets with his first request:
// so the first reply waits for DDS to make the two acquainted, and the next ones do not.
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
  /// So many who ask are answered; whoever has not been for longest is forgotten for the next one,
  /// and met again with his next request.
  static constexpr std::size_t most_requesters = 128;

  using OnRequest = std::function<void(const VariableRequest&)>;
  /// `participant` outlives it. Throws std::runtime_error with Cyclone's reason.
  VariableReplyEndpoint(const dds::Participant& participant,
                        const boost::asio::any_io_executor& executor, OnRequest on_request);
  ~VariableReplyEndpoint();
  VariableReplyEndpoint(const VariableReplyEndpoint&) = delete;
  VariableReplyEndpoint& operator=(const VariableReplyEndpoint&) = delete;

  /// Fails for a name or reason that is too long, and where DDS has no room for one more requester.
  tl::expected<void, std::string> publish(const InstanceId& requester, const VariableReply& reply);
  /// Who is known now.
  [[nodiscard]] std::size_t requesters() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
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

  /// What goes into each request as its requester.
  [[nodiscard]] const InstanceId& id() const;
  /// So many gateways hear requests now.
  [[nodiscard]] std::size_t gateways() const;
  /// A gateway may not hear it, or take it in and die: say it again, with the same token, until the
  /// reply is there.
  tl::expected<void, std::string> publish(const VariableRequest& request);

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::fabric::endpoints
