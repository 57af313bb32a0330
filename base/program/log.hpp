// The log format of all processes: one line per event on standard error, time in UTC.
//
//   auto log = program::make_log("gateway", level);
//   log->info("call {} seen on {}", call, channel);
//   → 2026-03-01T07:00:00.123Z gateway info  call 5f3a-12 seen on cnc/1
#pragma once

#include <memory>
#include <string>

#include <spdlog/logger.h>

namespace CLI {
class App;
}

namespace millrace::base::program {

/// Passed down from main; the global registry of spdlog is not used.
using Log = std::shared_ptr<spdlog::logger>;

/// A thread-safe logger to standard error that never waits for its reader: up to 1 MiB of lines is
/// kept for a blocked reader, and lines dropped beyond that are counted. The levels
/// (docs/reference/states-and-limits.md): error, warn - the operator must act or should know; info
/// - the operator's view of the machine; debug - the integrator of an NC program or service; trace
/// - the developer of millrace. The newest logger also gets the reports of report_contained().
/// Control characters of a logged text are escaped; further lines of an event are indented.
Log make_log(const std::string& name, spdlog::level::level_enum level = spdlog::level::info);

/// A logger that drops everything, for tests.
Log no_log();

/// Adds --log-level error|warn|info|debug|trace, default info.
void add_log_level(CLI::App& app, spdlog::level::level_enum& level);

}  // namespace millrace::base::program
