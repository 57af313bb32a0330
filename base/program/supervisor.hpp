// Notifies the supervisor that started the process: systemd's notification protocol (sd_notify(3)).
// Does nothing without a supervisor.
//
//   notify_supervisor("READY=1");
#pragma once

#include <chrono>
#include <optional>
#include <string_view>

namespace millrace::base::program {

/// Sends lines "NAME=VALUE" to the socket in NOTIFY_SOCKET. A supervisor that does not listen is
/// not a failure, so errors are ignored.
void notify_supervisor(std::string_view lines);

/// How often the supervisor expects WATCHDOG=1: half of WATCHDOG_USEC, as systemd advises. Nullopt
/// if it does not watch this process.
std::optional<std::chrono::microseconds> watchdog_period();

/// True if systemd's journal reads this descriptor (systemd.exec(5), JOURNAL_STREAM): then a line
/// may begin with its priority, "<3>" for an error (sd-daemon(3)).
bool is_journal(int fd);

}  // namespace millrace::base::program
