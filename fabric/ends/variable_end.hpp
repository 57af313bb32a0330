// The two ends of questions about variables: who answers, a gateway, and who asks.
//
//   VariableAnswerEnd end(participant, executor, [&](const VariableRequest& request) { … });
//   end.publish(request.asker, reply);
//
//   VariableAskEnd asking(participant, executor, [&](const VariableReply& reply) { … });
//   request.asker = asking.id();
//   if (asking.answerers() > 0) asking.publish(request);
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

namespace millrace::fabric::ends {

/// Its handler is called on the executor, one at a time, never from within a function of it.
class VariableAnswerEnd {
 public:
  /// So many who ask are answered; whoever has not been for longest is forgotten for the next one,
  /// and met again with his next request.
  static constexpr std::size_t most_askers = 128;

  using OnRequest = std::function<void(const VariableRequest&)>;
  /// `participant` outlives it. Throws std::runtime_error with Cyclone's reason.
  VariableAnswerEnd(const dds::Participant& participant,
                    const boost::asio::any_io_executor& executor, OnRequest on_request);
  ~VariableAnswerEnd();
  VariableAnswerEnd(const VariableAnswerEnd&) = delete;
  VariableAnswerEnd& operator=(const VariableAnswerEnd&) = delete;

  /// Fails for a name or reason that is too long, and where DDS has no room for one more asker.
  tl::expected<void, std::string> publish(const InstanceId& asker, const VariableReply& reply);
  /// Who is known now.
  [[nodiscard]] std::size_t askers() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

/// Likewise.
class VariableAskEnd {
 public:
  using OnReply = std::function<void(const VariableReply&)>;
  VariableAskEnd(const dds::Participant& participant, const boost::asio::any_io_executor& executor,
                 OnReply on_reply);
  ~VariableAskEnd();
  VariableAskEnd(const VariableAskEnd&) = delete;
  VariableAskEnd& operator=(const VariableAskEnd&) = delete;

  /// What goes into each request as its asker.
  [[nodiscard]] const InstanceId& id() const;
  /// So many gateways hear requests now.
  [[nodiscard]] std::size_t answerers() const;
  /// A gateway may not hear it, or take it in and die: say it again, with the same token, until the
  /// reply is there.
  tl::expected<void, std::string> publish(const VariableRequest& request);

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace millrace::fabric::ends
