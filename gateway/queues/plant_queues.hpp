// The message queues of all machines: which are read, and whose calls are there. Decides only;
// `QueuesIo` carries.
//
//   PlantQueues queues(io, events);
//   queues.set(settings::queues_of(machines), journal.ledger().queues());
//   queues.on_up("press", {1, 2});
//   queues.read(key, ReadSet::request);
//   queues.finish();                                     → events.on_queue_read(key, snapshot)
//
// set() comes again when the configuration changes. A queue's calls go on without its controller,
// as long as messages of it are in the journal.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "fabric/data.hpp"
#include "gateway/queue_book.hpp"
#include "gateway/queues/machine_queue.hpp"

namespace millrace::gateway::queues {

/// Called from within finish() alone, but for the last three.
class QueueEvents {
 public:
  virtual ~QueueEvents() = default;
  /// The queue's calls are ours from now on; again when they were already.
  virtual void on_queue_open(const fabric::ChannelKey& key) = 0;
  /// The controller does not answer, and no message is left.
  virtual void on_queue_down(const fabric::ChannelKey& key, const std::string& reason) = 0;
  /// The queue is not ours any more: its call under way is finished first. Answered by on_over().
  virtual void on_queue_retired(const fabric::ChannelKey& key) = 0;
  virtual void on_queue_read(const fabric::ChannelKey& key, const Snapshot& snapshot) = 0;
  virtual void on_queue_write(const fabric::ChannelKey& key) = 0;
  virtual void on_queue_change(const fabric::ChannelKey& key) = 0;
  /// Journal these in their order; answered by on_recorded() with the ticket of the last.
  virtual void record_of_queue(const std::vector<JournalEntry>& entries, const Ticket& ticket) = 0;
  virtual void say_of_queue(const fabric::ChannelKey& key, const Queue::News& news) = 0;
  virtual void tell_queue(const fabric::DataSample& sample) = 0;
};

class PlantQueues {
 public:
  /// Both outlive it.
  PlantQueues(QueuesIo& io, QueueEvents& events) : io_(io), events_(events) {}
  PlantQueues(const PlantQueues&) = delete;
  PlantQueues& operator=(const PlantQueues&) = delete;

  /// The queues to read from now on, by their machines. `known` is what the journal has of queues;
  /// what it has of others stays there.
  void set(const std::map<std::string, std::vector<QueueSettings>>& wanted,
           const std::map<fabric::ChannelKey, QueueBook>& known);
  [[nodiscard]] bool has(const fabric::ChannelKey& key) const { return queues_.contains(key); }

  void on_up(const std::string& machine, const std::vector<std::uint16_t>& channels);
  void on_down(const std::string& machine, const std::string& reason);
  /// The channel is another gateway's, or nobody's.
  void on_left(const std::string& machine, std::uint16_t channel, const std::string& reason);
  /// The calls of a queue that was retired are over.
  void on_over(const fabric::ChannelKey& key);
  /// Of a queue.
  void on_recorded(const Ticket& ticket);
  // Of the link of its machine.
  void on_answer(const fabric::ChannelKey& key, StepAnswer answer);
  void on_event(const fabric::ChannelKey& key);

  // What the calls of a queue want of its channel.
  void read(const fabric::ChannelKey& key, ReadSet look);
  void write(const fabric::ChannelKey& key, const Write& write);

  [[nodiscard]] Snapshot look(const fabric::ChannelKey& key, ReadSet what) const {
    return queues_.at(key).queue->look(what);
  }

  /// About once a second: tells each queue in numbers.
  void tell_numbers();

  /// Where each event ends: answers what the calls of queues have asked meanwhile. What a call
  /// wants of its channel is never answered from within. False if there was nothing.
  bool finish();
  void on_time();
  /// When on_time() has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const;

 private:
  struct One {
    std::string machine{};
    QueueSettings settings{};
    std::unique_ptr<MachineQueue> queue{};
    /// Which one of this key.
    std::uint64_t number = 0;
    /// Its channel is served by us.
    bool ours = false;
    /// The configuration names it no more.
    bool leaving = false;
    bool retired = false;
    /// Reads and writes that are not answered yet.
    std::size_t asked = 0;
    /// To be opened once they are.
    bool opens = false;
    fabric::DataSample told{};
  };

  void begin(const fabric::ChannelKey& key, One& one, QueueBook book);
  void review(const fabric::ChannelKey& key, One& one);
  void reach(const fabric::ChannelKey& key, One& one);
  void open(const fabric::ChannelKey& key, One& one);
  void open_now(const fabric::ChannelKey& key, One& one);
  template <typename Tell>
  void answer(const fabric::ChannelKey& key, Tell tell);
  void tell_numbers(const fabric::ChannelKey& key, One& one);

  QueuesIo& io_;
  QueueEvents& events_;
  std::map<fabric::ChannelKey, One> queues_;
  std::uint64_t begun_ = 0;
  /// Whether a machine can be reached, and the channels of it that are ours.
  struct Reach {
    std::set<std::uint16_t> channels{};
    bool up = false;
  };
  std::map<std::string, Reach> machines_;
  /// What finish() does, in this order.
  std::deque<std::function<void()>> due_;
};

}  // namespace millrace::gateway::queues
