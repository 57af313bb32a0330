// The actions of channels: those of controllers, and those that the gateway simulates for message
// queues.
#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "gateway/core/core.hpp"

namespace millrace::gateway::core {

void Core::read(const fabric::ChannelKey& key, ReadSet set) {
  queues_.has(key) ? queues_.read(key, set) : machines_.read(key, set);
}

void Core::write(const fabric::ChannelKey& key, const Write& write) {
  if (queues_.has(key)) {
    write_queue(key, write);
  } else {
    machines_.write(key, write.variable, write.value);
  }
}

void Core::write_queue(const fabric::ChannelKey& key, const Write& write) {
  queues_.write(key, write, now_);
}

void Core::append(const JournalEntry& entry, const Ticket& ticket) {
  host_.append(entry, ticket);
}

void Core::publish(const fabric::Request& request) {
  fabric_.publish(request);
}

void Core::publish(const fabric::Event& event) {
  fabric_.publish(event);
}

void Core::publish(const fabric::ChannelStatus& status) {
  fabric_.publish(status);
}

void Core::dispose(const fabric::RequestKey& request) {
  fabric_.dispose(request);
}

void Core::dispose(const fabric::ChannelKey& key) {
  fabric_.dispose(key);
  queues_.has(key) ? queues_.on_over(key) : machines_.on_over(key);
}

void Core::log(const fabric::ChannelKey& key, Level level, const std::string& text) {
  host_.log(level, fmt::format("{}: {}", key.to_string(), text));
}

void Core::report_write_problem(const fabric::ChannelKey& key, const fabric::Message& problem) {
  host_.set_alarm({.kind = "write", .subject = key.to_string()},
                  problem.empty() ? problem : base::messages::about(key.to_string(), problem),
                  base::messages::check_controller());
}

}  // namespace millrace::gateway::core
