// A link to a controller that does nothing, as a base for tests that need part of one.
#pragma once

#include "gateway/machines/controller.hpp"

namespace millrace::tests {

class SilentLink : public gateway::machines::Controller {
 public:
  void read(std::uint16_t, gateway::ReadSet) override {}
  void write(std::uint16_t, gateway::Variable, const gateway::Value&) override {}
  void subscribe(const gateway::machines::Channels&) override {}
  void unsubscribe(const gateway::machines::Channels&) override {}
  void ask(const gateway::machines::Question&) override {}
  void open(const fabric::ChannelKey&, const gateway::queues::QueueSettings&) override {}
  void ask(const fabric::ChannelKey&, const gateway::queues::Step&) override {}
  void subscribe(const fabric::ChannelKey&) override {}
  [[nodiscard]] gateway::machines::LinkLoad load() const override { return {}; }
};

}  // namespace millrace::tests
