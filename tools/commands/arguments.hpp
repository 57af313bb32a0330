// Command-line values of several subcommands.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include <CLI/App.hpp>

#include "fabric/messages.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::commands {

/// `5f3a9c0112d4-17`.
CLI::Option* add_call(CLI::App& command, const std::string& name, fabric::CallId& call,
                      const std::string& description);
/// `250ms`, `30s`, `5m`, `2h`, `7d`.
CLI::Option* add_duration(CLI::App& command, const std::string& name,
                          std::chrono::nanoseconds& duration, const std::string& description);
/// `64MiB`, `64MB`.
CLI::Option* add_size(CLI::App& command, const std::string& name, std::uint64_t& size,
                      const std::string& description);

// Each may be given several times.
void add_machine_filter(CLI::App& command, recording::Filter& filter);
void add_uuid_filter(CLI::App& command, recording::Filter& filter);
/// --call, --from, --to, for recordings.
void add_time_filter(CLI::App& command, recording::Filter& filter);

/// --machine, --channel, --uuid; each may be given several times.
void add_filter(CLI::App& command, recording::Filter& filter);
/// --call, --kind, --from, --to on top, for what is recorded.
void add_recording_filter(CLI::App& command, recording::Filter& filter);

// Input without echo: passwords.

/// Reads a line of standard input. A terminal shows "PROMPT: " and no echo.
std::string read_hidden(const std::string& prompt);

}  // namespace millrace::tools::commands
