// A message queue in numbers, as machine data have them.
#pragma once

#include "fabric/data.hpp"
#include "gateway/queues/message_queue.hpp"

namespace millrace::gateway::queues {

/// The group "queue" of its key (fabric/queue_group.hpp).
[[nodiscard]] fabric::DataSample sample_of(const fabric::ChannelKey& key,
                                           const QueueSettings& settings, const QueueView& view,
                                           fabric::Time at);

}  // namespace millrace::gateway::queues
