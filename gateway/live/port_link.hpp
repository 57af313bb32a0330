// A queue's link over a port to its controller: each question is a coroutine of its own.
//
//   PortLink link(executor, key, std::make_unique<SymbolQueue>(client, settings), events);
//   link.ask(ReadControl{});                          → events.on_queue_answer(key, answer)
#pragma once

#include <memory>

#include <boost/asio/any_io_executor.hpp>

#include "gateway/live/queue_port.hpp"
#include "gateway/queues/queue_link.hpp"

namespace millrace::gateway::live {

class PortLink final : public queues::QueueLink {
 public:
  /// `events` outlives it.
  PortLink(boost::asio::any_io_executor executor, const fabric::ChannelKey& queue,
           std::unique_ptr<QueuePort> port, queues::QueueLinkEvents& events);
  ~PortLink() override;
  PortLink(const PortLink&) = delete;
  PortLink& operator=(const PortLink&) = delete;

  void ask(const queues::Step& step) override;
  void watch() override;

 private:
  struct Held;
  static boost::asio::awaitable<void> carry_out(std::shared_ptr<Held> held, queues::Step step);
  static boost::asio::awaitable<void> let_tell(std::shared_ptr<Held> held);

  boost::asio::any_io_executor executor_;
  std::shared_ptr<Held> held_;
};

}  // namespace millrace::gateway::live
