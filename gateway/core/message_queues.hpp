// The message queues of all machines: which are read, what is asked of their controllers, and whose
// calls are there. A queue's calls are those of a channel that the gateway plays itself: what they
// ask of it is answered by events, which the core takes one after the other. Pure.
//
//   MessageQueues queues(fabric, host);
//   queues.set(machines, journal.state().queues(), now);
//   queues.on_up("press", {1, 2}, link, now);            → link.open(…), link.ask(…)
//   queues.read(key, ReadSet::request);
//   while (const auto event = queues.next_event()) …     // ChannelEvent::Kind::read
//     queues.on_event_delivered(*event);
//
// set() comes again when the configuration changes. A queue's calls go on without its controller,
// as long as messages of it are in the journal.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "fabric/data.hpp"
#include "gateway/core/ports.hpp"
#include "gateway/queue_log.hpp"
#include "gateway/queues/message_queue.hpp"
#include "gateway/queues/queue_reader.hpp"

namespace millrace::gateway::core {

class MessageQueues : public ServiceAccess {
 public:
  /// Both outlive it.
  MessageQueues(Fabric& fabric, Host& host) : fabric_(fabric), host_(host) {}
  MessageQueues(const MessageQueues&) = delete;
  MessageQueues& operator=(const MessageQueues&) = delete;

  /// The queues of these machines are read from now on. `known` has the queues of the journal;
  /// entries of other queues stay there.
  void set(const std::vector<settings::MachineSettings>& machines,
           const std::map<fabric::ChannelKey, QueueLog>& known, Moment now);

  /// `link` stays until on_link_gone().
  void on_up(const std::string& machine, const machines::Channels& channels,
             machines::Controller& link, Moment now);
  void on_down(const std::string& machine, const fabric::Message& reason);
  /// The channel has another owner, or none.
  void on_channel_lost(const std::string& machine, std::uint16_t channel,
                       const fabric::Message& reason);
  /// So are all of them.
  void on_link_gone(const std::string& machine, const fabric::Message& reason);
  /// The calls of a queue that is drained are over.
  void on_over(const fabric::ChannelKey& key) override;
  /// Of a queue.
  void on_recorded(const Ticket& ticket, Moment now);
  // Of the link of its machine.
  void on_answer(const fabric::ChannelKey& key, queues::StepAnswer answer, Moment now);
  void on_change(const fabric::ChannelKey& key, Moment now);

  // The reads of a queue's calls from its channel.
  void read(const fabric::ChannelKey& key, ReadSet set) override;
  void write(const fabric::ChannelKey& key, const Write& write, Moment now) override;
  [[nodiscard]] ServiceSnapshot snapshot(const fabric::ChannelKey& key, ReadSet what) const {
    return queues_.at(key).queue.snapshot(what);
  }

  /// Of the channel of a queue's calls.
  struct ChannelEvent {
    enum class Kind : std::uint8_t {
      /// The calls are ours from now on; again when they were already.
      opened,
      /// The controller does not answer, and no message is left.
      down,
      /// They are not ours any more: the one under way is finished first. Answered by on_over().
      draining,
      /// The result of read().
      read,
      /// The acknowledgement of write().
      written,
      /// Another message is shown.
      changed,
    };
    Kind kind = Kind::changed;
    fabric::ChannelKey key;
    /// Why it is down.
    fabric::Message reason{};
    /// The values that were read.
    ServiceSnapshot shown{};
    /// The number of the queue: another one with this key may have replaced it.
    std::uint64_t number = 0;
  };
  /// The next one for the core; then on_event_delivered().
  std::optional<ChannelEvent> next_event();
  void on_event_delivered(const ChannelEvent& event);

  /// About once a second: publishes the numbers of each queue.
  void publish_numbers(Moment now);
  void on_time(Moment now);
  /// When on_time() has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const;

 private:
  struct Served {
    Served(std::string of, const queues::QueueSettings& settings, QueueLog queue_log)
        : machine(std::move(of)), queue(machine, settings, std::move(queue_log)) {}

    std::string machine;
    queues::MessageQueue queue;
    /// Distinguishes queues of the same key.
    std::uint64_t number = 0;
    /// Its link, if there is one.
    machines::Controller* link = nullptr;
    /// A request is pending.
    bool asking = false;
    /// Notifications were requested from the controller.
    bool subscribed = false;
    /// Its channel is served by us.
    bool owned = false;
    /// It was removed from the configuration.
    bool removed = false;
    bool draining = false;
    /// Reads and writes of its calls that are not answered yet.
    std::size_t asked = 0;
    /// To be opened once they are.
    bool opens = false;
    /// Its numbers as last published.
    fabric::DataSample published{};

    [[nodiscard]] bool has_messages() const { return queue.queue_log().waiting() > 0; }
    [[nodiscard]] std::optional<SteadyTime> next_time() const {
      return link != nullptr && !asking ? queue.next_time() : std::nullopt;
    }
  };
  /// The link of a machine while it is up, and the channels of it that are ours.
  struct Reach {
    std::set<std::uint16_t> channels{};
    machines::Controller* link = nullptr;
  };
  using Kind = ChannelEvent::Kind;

  Served* find(const fabric::ChannelKey& key);
  void review(const fabric::ChannelKey& key, Served& served);
  void reach(const fabric::ChannelKey& key, Served& served, Moment now);
  void open(const fabric::ChannelKey& key, Served& served);
  void lose_channel(const fabric::ChannelKey& key, Served& served, const fabric::Message& reason);
  void go_down(Served& served, const fabric::Message& reason);
  void ask_next(Served& served, Moment now);
  void take_output(Served& served);
  void log(const fabric::ChannelKey& key, const queues::MessageQueue::Output& output);
  void publish_numbers(Served& served, Moment now);

  Fabric& fabric_;
  Host& host_;
  std::map<fabric::ChannelKey, Served> queues_;
  std::uint64_t begun_ = 0;
  std::map<std::string, Reach> machines_;
  std::deque<ChannelEvent> events_;
};

}  // namespace millrace::gateway::core
