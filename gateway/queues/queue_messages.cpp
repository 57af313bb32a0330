#include "gateway/queues/queue_messages.hpp"

#include <fmt/format.h>

namespace millrace::gateway::queues {

std::string filling_message(const QueueSettings& settings, const Control& control,
                            std::size_t waiting, const std::string& key) {
  const std::string full = fmt::format(
      "when the queue is full, the next SSDQ is a runtime error of its NC program; `millrace "
      "channels` shows why the call of {} waits",
      key);
  if (settings.acknowledge == Acknowledge::when_answered) {
    return fmt::format(
        "{} of {} messages that fit into {} have no response yet from {}, and stay in the queue "
        "(drain: WHEN_ANSWERED); {}",
        filled(control), control.elements - 1, settings.array, settings.uuid, full);
  }
  return fmt::format(
      "{} of {} messages that the journal may hold (backlog) wait for {}, and {} of {} that fit "
      "into {} are in the queue; {}",
      waiting, settings.backlog, settings.uuid, filled(control), control.elements - 1,
      settings.array, full);
}

}  // namespace millrace::gateway::queues
