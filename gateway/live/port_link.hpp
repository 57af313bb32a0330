// A queue's link over a port to its controller: each question is a coroutine of its own.
//
//   PortLink link(executor, std::make_unique<SymbolQueue>(client, settings), begin_event);
//   link.ask(ReadControl{}, [](StepAnswer answer) { … });
#pragma once

#include <functional>
#include <memory>

#include <boost/asio/any_io_executor.hpp>

#include "gateway/live/queue_port.hpp"
#include "gateway/queues/queue_link.hpp"

namespace millrace::gateway::live {

class PortLink final : public queues::QueueLink {
 public:
  /// `begin` comes before each answer, and may end this link.
  PortLink(boost::asio::any_io_executor executor, std::unique_ptr<QueuePort> port,
           std::function<void()> begin);
  ~PortLink() override;
  PortLink(const PortLink&) = delete;
  PortLink& operator=(const PortLink&) = delete;

  void ask(const queues::Step& step, std::function<void(queues::StepAnswer)> answered) override;
  void watch(std::function<void()> told) override;

 private:
  struct Held;
  static boost::asio::awaitable<void> carry_out(std::shared_ptr<Held> held, queues::Step step,
                                                std::function<void(queues::StepAnswer)> answered);
  static boost::asio::awaitable<void> let_tell(std::shared_ptr<Held> held,
                                               std::function<void()> told);

  boost::asio::any_io_executor executor_;
  std::shared_ptr<Held> held_;
};

}  // namespace millrace::gateway::live
