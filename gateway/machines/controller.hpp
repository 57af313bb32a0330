// The connection to one controller for the rest of the gateway: carries reads and writes, and
// reconnects by itself after each failure. AdsController is the one with a socket.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/machines/machine_status_writer.hpp"
#include "gateway/machines/subscriptions.hpp"
#include "gateway/outputs.hpp"
#include "gateway/queues/queue_reader.hpp"
#include "gateway/queues/queue_settings.hpp"
#include "gateway/variables/variable_requests.hpp"

namespace millrace::gateway::machines {

using Channels = std::vector<std::uint16_t>;

/// The part that requests values of a controller, besides calls.
enum class Requester : std::uint8_t { data, variables };

struct Question {
  Requester requester = Requester::data;
  /// The answer has it too.
  std::uint64_t number = 0;
  variables::Step step;
};

/// The response to a request: descriptions of variables, values, a confirmed write, or a list.
struct Answer {
  Requester requester = Requester::data;
  std::uint64_t number = 0;
  std::variant<std::vector<data::Sampler::Resolved>, std::vector<data::Sampler::Answer>,
               cnc::ads::Result<void>, cnc::ads::Result<variables::Page>>
      found;
  /// That it took at the controller.
  std::uint64_t requests = 0;
  /// The controller reads many values in one request.
  bool sums = true;
};

/// Why a connection could not be made, or has ended.
struct LinkLoss {
  LinkLoss(fabric::Message the_reason, std::chrono::nanoseconds without_response = {})
      : reason(std::move(the_reason)), silent_for(without_response) {}
  /// For people.
  fabric::Message reason;
  /// The time since the last response of the controller, if that is the reason.
  std::chrono::nanoseconds silent_for;
};

/// Never called from within a function of the link. The link may be gone when a call returns, so
/// what is handed in must not be a part of it.
class ControllerEvents {
 public:
  virtual ~ControllerEvents() = default;
  /// The controller answers and has a Service Interface in these channels.
  virtual void on_link_up(const std::string& machine,
                          const std::vector<std::uint16_t>& channels) = 0;
  /// Every read and write is answered before the link comes up again.
  virtual void on_link_down(const std::string& machine, const LinkLoss& loss) = 0;
  virtual void on_read(const fabric::ChannelKey& key, const ServiceSnapshot& snapshot) = 0;
  /// `reason` is empty if the link is gone, which on_link_down explains.
  virtual void on_read_failed(const fabric::ChannelKey& key, const fabric::Message& reason) = 0;
  virtual void on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                        const fabric::Message& reason) = 0;
  /// The result of subscribe(), once for each channel; none if the link is gone.
  virtual void on_subscribed(const std::string& machine,
                             const std::vector<SubscribeOutcome>& outcomes) = 0;
  /// A notification of a watched state, at first and after each change; without a value: the
  /// controller has stopped sending them. May come before on_subscribed().
  virtual void on_notification(const fabric::ChannelKey& key, Variable variable,
                               std::optional<std::uint32_t> value) = 0;
  /// The result of ask(); none if the link is gone.
  virtual void on_answer(const std::string& machine, const Answer& answer) = 0;
  /// The result of ask() for a queue, unless the queue was opened again; none if the link is gone.
  virtual void on_queue_answer(const fabric::ChannelKey& queue, queues::StepAnswer answer) = 0;
  /// The controller notifies a change in the queue.
  virtual void on_queue_event(const fabric::ChannelKey& queue) = 0;
};

/// Its destructor closes the connection and removes all subscriptions at the controller; no event
/// comes after it.
class Controller {
 public:
  virtual ~Controller() = default;
  virtual void read(std::uint16_t channel, ReadSet set) = 0;
  virtual void write(std::uint16_t channel, Variable variable, const Value& value) = 0;
  /// Requests notifications of both states of these channels; answered by on_subscribed().
  /// unsubscribe() cancels that, whatever the answer was or will be, and has no answer.
  virtual void subscribe(const std::vector<std::uint16_t>& channels) = 0;
  virtual void unsubscribe(const std::vector<std::uint16_t>& channels) = 0;
  /// One question of each requester at a time.
  virtual void ask(const Question& question) = 0;
  /// Opens a message queue of this controller: earlier requests for it get no answer any more.
  virtual void open(const fabric::ChannelKey& queue, const queues::QueueSettings& settings) = 0;
  /// Of a queue that is open, one question at a time.
  virtual void ask(const fabric::ChannelKey& queue, const queues::Step& step) = 0;
  /// Asks the controller for notifications of its changes: late, for nothing, or never.
  virtual void subscribe(const fabric::ChannelKey& queue) = 0;
  [[nodiscard]] virtual LinkLoad load() const = 0;
};

}  // namespace millrace::gateway::machines
