// Carries out what one message queue wants: its questions to the controller one after the other,
// and what it tells.
//
//   auto queue = std::make_shared<MachineQueue>(executor, "press", settings, book, now, outlet);
//   queue->on_up(client);                          → outlet.record(entries), outlet.shows()
//   queue->write(Variable::response_state, 1);
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/steady_timer.hpp>

#include "gateway/live/queue_port.hpp"
#include "gateway/queues/queue.hpp"

namespace millrace::gateway::live {

/// What a queue tells, on the executor, never from within the one that is told.
struct QueueOutlet {
  /// An event begins: it may take the link away.
  std::function<void()> begin;
  /// Journal these in their order; `recorded`, if it is not empty, once the last is safe.
  std::function<void(const std::vector<JournalEntry>&, std::function<void()> recorded)> record;
  /// Another message is shown.
  std::function<void()> shows;
  std::function<void(const queues::Queue::News&)> tell;
};

class MachineQueue : public std::enable_shared_from_this<MachineQueue> {
 public:
  MachineQueue(boost::asio::any_io_executor executor, const std::string& machine,
               queues::QueueSettings settings, QueueBook book, std::function<Moment()> now,
               QueueOutlet outlet);

  /// The link is up; `port` is that of this link.
  void on_up(std::unique_ptr<QueuePort> port);
  void on_down(const std::string& reason);
  /// Tells nobody any more.
  void stop();
  [[nodiscard]] bool up() const { return port_ != nullptr; }

  [[nodiscard]] const queues::Queue& queue() const { return queue_; }
  [[nodiscard]] Snapshot look(ReadSet what) const { return queue_.look(what); }
  void write(Variable variable, const Value& value);
  void on_acknowledged();
  /// What it has to tell.
  void tell();

 private:
  void go_on();
  void wait();
  static boost::asio::awaitable<void> carry_out(std::shared_ptr<MachineQueue> self,
                                                std::shared_ptr<QueuePort> port, queues::Step step);
  static boost::asio::awaitable<void> watch(std::shared_ptr<MachineQueue> self,
                                            std::shared_ptr<QueuePort> port);

  boost::asio::any_io_executor executor_;
  queues::Queue queue_;
  std::function<Moment()> now_;
  QueueOutlet outlet_;
  boost::asio::steady_timer timer_;
  std::optional<SteadyTime> waits_until_;
  std::shared_ptr<QueuePort> port_;
  bool asking_ = false;
  bool watched_ = false;
  bool stopped_ = false;
};

}  // namespace millrace::gateway::live
