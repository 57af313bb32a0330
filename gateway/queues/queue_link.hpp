// The way to one message queue over one link to its controller, as the queue sees it: carries its
// questions. live::PortLink is the one with a socket.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/messages.hpp"
#include "gateway/queues/reader.hpp"
#include "gateway/queues/ring.hpp"

namespace millrace::gateway::queues {

template <typename T>
using Answer = tl::expected<T, std::string>;

/// What has come of a Step, in the order of their types; errors are words that go behind the name
/// of the queue.
using StepAnswer = std::variant<Answer<Control>, Answer<std::vector<std::string>>, Answer<void>>;

/// What a link says, never from within its functions. It may be gone when a call returns, so what
/// is handed in must not be a part of it.
class QueueLinkEvents {
 public:
  virtual ~QueueLinkEvents() = default;
  /// What has come of ask().
  virtual void on_queue_answer(const fabric::ChannelKey& queue, StepAnswer answer) = 0;
  /// The controller tells of a change.
  virtual void on_queue_event(const fabric::ChannelKey& queue) = 0;
};

/// Its end leaves what was asked unanswered; what was sent may be done all the same.
class QueueLink {
 public:
  virtual ~QueueLink() = default;
  /// One at a time.
  virtual void ask(const Step& step) = 0;
  /// Asks the controller to tell of changes: late, for nothing, or never.
  virtual void watch() = 0;
};

}  // namespace millrace::gateway::queues
