// The gateway's alarms about its certificates for Secure ADS: when they expire, and in the last
// days what to do. Pure.
#pragma once

#include <chrono>
#include <vector>

#include "fabric/alarm.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::shell {

/// One for each certificate, whatever the number of its machines; its subject stays the same.
std::vector<fabric::Alarm> certificate_alarms(
    const std::vector<settings::MachineSettings>& machines, std::chrono::sys_seconds now);

}  // namespace millrace::gateway::shell
