// A summary of an instance's calls, for a log that does not list each. Pure.
//
//   if (auto line = call_summary(before, now, 60s)) log->info(*line);
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "fabric/messages.hpp"

namespace millrace::services::sdk {

/// The activity of the instance between these two, `span` apart; nullopt if no call came and none
/// ended.
std::optional<std::string> call_summary(const fabric::InstanceStatus& before,
                                        const fabric::InstanceStatus& now,
                                        std::chrono::seconds span);

}  // namespace millrace::services::sdk
