// The configuration of a message queue.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "fabric/channel_scope.hpp"

namespace millrace::gateway::queues {

/// When LastGet shows that a message was read.
enum class Acknowledge : std::uint8_t {
  /// Once it is in the journal: a missing service never fills the queue.
  when_journalled,
  /// Once it is answered: the queue itself keeps the messages, as far as it has room.
  when_answered,
};

struct QueueSettings {
  /// On the fabric: letters, digits, '_' and '-'.
  std::string name{};
  std::uint16_t channel = 1;
  /// Symbols of the array and of its control structure: "SD.ALARMS", "SD.CONTROL".
  std::string array{};
  std::string control{};
  /// Members of the control structure (DOK-MTX***-NC*F*EX*V13, p. 655, documented).
  static constexpr const char* last_filled = "LastFilled";
  static constexpr const char* last_get = "LastGet";
  /// The UUID of the service for the messages.
  std::string uuid{};
  Acknowledge acknowledge = Acknowledge::when_journalled;
  /// Between two reads at a queue without messages.
  std::chrono::milliseconds period{10};
  /// Messages that may wait in the journal; more stay in the queue.
  std::size_t backlog = 10'000;
  /// Whether notifications are requested from the controller in addition.
  bool events = false;
  bool operator==(const QueueSettings&) const = default;

  /// Of its calls, beside those of its channel: "press.alarms/1".
  [[nodiscard]] fabric::ChannelKey key(const std::string& machine) const {
    return {fabric::queue_owner(machine, name), channel};
  }
};

}  // namespace millrace::gateway::queues
