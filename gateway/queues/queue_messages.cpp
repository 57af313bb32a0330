#include "gateway/queues/queue_messages.hpp"

#include <fmt/format.h>

namespace millrace::gateway::queues {

std::string filling_message(const QueueSettings& settings, const Control& control,
                            std::size_t waiting, const std::string& key) {
  const std::string full = fmt::format(
      "when it is full, the next SSDQ is a runtime error of its program; see in millrace "
      "channels why the call of {} waits",
      key);
  if (settings.acknowledge == Acknowledge::when_answered) {
    return fmt::format(
        "{} of {} messages that {} has room for are not answered yet by {}, and stay there (drain: "
        "WHEN_ANSWERED); {}",
        filled(control), control.elements - 1, settings.array, settings.uuid, full);
  }
  return fmt::format(
      "{} of {} messages that may wait in the journal (backlog) wait for {}, and {} of {} that {} "
      "has room for stand there; {}",
      waiting, settings.backlog, settings.uuid, filled(control), control.elements - 1,
      settings.array, full);
}

}  // namespace millrace::gateway::queues
