// Words to the supervisor that started the program: systemd's notification protocol (sd_notify(3)).
// Without a supervisor nothing happens.
//
//   tell_supervisor("READY=1");
#pragma once

#include <chrono>
#include <optional>
#include <string_view>

namespace millrace::base::program {

/// Sends lines "NAME=VALUE" to the socket that NOTIFY_SOCKET names. A supervisor that does not
/// listen is no reason to fail, so errors are ignored.
void tell_supervisor(std::string_view lines);

/// How often the supervisor wants to hear WATCHDOG=1: half of WATCHDOG_USEC, as systemd advises.
/// None if it does not watch this process.
std::optional<std::chrono::microseconds> watchdog_period();

/// Whether systemd's journal reads this descriptor (systemd.exec(5), JOURNAL_STREAM): then a line
/// may begin with its priority, "<3>" for an error (sd-daemon(3)).
bool is_journal(int fd);

}  // namespace millrace::base::program
