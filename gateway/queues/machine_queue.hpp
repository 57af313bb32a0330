// Has done what one message queue wants: its questions to the controller one after the other, and
// what it tells. Decides when; the link of its machine carries.
//
//   MachineQueue queue("press", settings, book, io, outlet);
//   queue.on_up();                                → io.open(…), io.ask(…)
//   queue.on_answer(answer);                      → outlet.record(entries), outlet.shows()
//   queue.write({Variable::response_state, 1, true});
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gateway/queues/queue.hpp"
#include "gateway/queues/step_answer.hpp"

namespace millrace::gateway::queues {

/// What the queues have done for them. Calls nothing back from within.
class QueuesIo {
 public:
  virtual ~QueuesIo() = default;
  [[nodiscard]] virtual Moment now() const = 0;
  // As machines::Link has them; answered by on_answer() and on_event().
  virtual void open(const std::string& machine, const QueueSettings& settings) = 0;
  virtual void ask(const std::string& machine, const fabric::ChannelKey& queue,
                   const Step& step) = 0;
  virtual void watch(const std::string& machine, const fabric::ChannelKey& queue) = 0;
};

/// What a queue tells, never from within the one that is told.
struct QueueOutlet {
  /// Journal these in their order; on_recorded() once the last is safe, if `wait`.
  std::function<void(const std::vector<JournalEntry>&, bool wait)> record;
  /// Another message is shown.
  std::function<void()> shows;
  std::function<void(const Queue::News&)> tell;
};

class MachineQueue {
 public:
  /// `io` outlives it.
  MachineQueue(const std::string& machine, QueueSettings settings, QueueBook book, QueuesIo& io,
               QueueOutlet outlet);

  /// The link of its machine is up.
  void on_up();
  void on_down(const std::string& reason);
  /// The configuration has changed: it is not asked before it is up again.
  void change(QueueSettings settings);
  /// Of its link.
  void on_answer(StepAnswer answer);
  void on_event();
  [[nodiscard]] bool up() const { return up_; }

  [[nodiscard]] const Queue& queue() const { return queue_; }
  [[nodiscard]] Snapshot look(ReadSet what) const { return queue_.look(what); }
  void on_read(ReadSet what) { queue_.on_read(what); }
  void write(const Write& write);
  void on_acknowledged();
  void on_recorded();
  /// What it has to tell.
  void tell();
  void on_time();
  /// When on_time() has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const;

 private:
  void go_on();

  std::string machine_;
  Queue queue_;
  QueuesIo& io_;
  QueueOutlet outlet_;
  bool up_ = false;
  bool asking_ = false;
  bool watched_ = false;
};

}  // namespace millrace::gateway::queues
