// What a gateway says of the certificates with which it reaches controllers over Secure ADS: when
// they end, and in the last days what to do about it. Pure.
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
