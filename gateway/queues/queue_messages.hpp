// What a queue says to people.
#pragma once

#include <string>

#include "gateway/queues/queue_settings.hpp"
#include "gateway/queues/ring.hpp"

namespace millrace::gateway::queues {

/// It fills up, and why nobody empties it.
[[nodiscard]] std::string filling_message(const QueueSettings& settings, const Control& control,
                                          std::size_t waiting, const std::string& key);

}  // namespace millrace::gateway::queues
