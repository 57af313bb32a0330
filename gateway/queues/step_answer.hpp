// The responses of a controller to the requests of a message queue.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "gateway/queues/queue_reader.hpp"
#include "gateway/queues/ring.hpp"

namespace millrace::gateway::queues {

template <typename T>
using Answer = tl::expected<T, std::string>;

/// The result of a Step, in the order of their types; errors are phrases that follow the name of
/// the queue.
using StepAnswer = std::variant<Answer<Control>, Answer<std::vector<std::string>>, Answer<void>>;

}  // namespace millrace::gateway::queues
