// Messages about a queue for people.
#pragma once

#include <string>

#include "gateway/queues/queue_settings.hpp"
#include "gateway/queues/ring.hpp"

namespace millrace::gateway::queues {

/// The queue fills up, and why its messages are not read.
[[nodiscard]] std::string filling_message(const QueueSettings& settings, const Control& control,
                                          std::size_t waiting, const std::string& key);

}  // namespace millrace::gateway::queues
