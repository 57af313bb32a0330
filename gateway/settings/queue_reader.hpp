// The configuration of a machine's message queues, checked.
#pragma once

#include <vector>

#include "base/configuration/mistakes.hpp"
#include "gateway/queues/queue_settings.hpp"
#include "idl/gateway.pb.h"

namespace millrace::gateway::settings {

/// Notes every mistake with its place; `path` leads to the machine.
std::vector<queues::QueueSettings> read_queues(const config::Machine& from,
                                               const base::configuration::ConfigPath& path,
                                               base::configuration::Mistakes& mistakes);

}  // namespace millrace::gateway::settings
