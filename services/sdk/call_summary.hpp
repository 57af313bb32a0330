// What a log has of an instance's calls where it does not have each of them. Pure.
//
//   if (auto line = call_summary(before, now, 60s)) log->info(*line);
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "fabric/messages.hpp"

namespace millrace::services::sdk {

/// What the instance did between these two, `span` apart; nothing if no call came and none ended.
std::optional<std::string> call_summary(const fabric::InstanceStatus& before,
                                        const fabric::InstanceStatus& now,
                                        std::chrono::seconds span);

}  // namespace millrace::services::sdk
