// `millrace recording`: reading recordings. One source file per subcommand.
#pragma once

#include <filesystem>

#include "tools/commands/subcommand.hpp"
#include "tools/mcap/file.hpp"
#include "tools/mcap/records.hpp"

namespace millrace::tools::commands::recordings {

/// `recording` with all its subcommands.
void add_recording(CLI::App& app, Chosen& chosen);

void add_info(CLI::App& recording, Chosen& chosen);
void add_cat(CLI::App& recording, Chosen& chosen);
void add_calls(CLI::App& recording, Chosen& chosen);
void add_export(CLI::App& recording, Chosen& chosen);
void add_repair(CLI::App& recording, Chosen& chosen);

/// Adds the argument FILE.
void add_file(CLI::App& command, std::filesystem::path& file);

/// Throws UsageError if it cannot be read.
mcap::FileSource open(const std::filesystem::path& file);

/// Names each problem on standard error, and whether anything else was read; returns the exit code,
/// which tells whether there are any.
int report(const std::filesystem::path& file, const mcap::Problems& problems, bool has_read);

}  // namespace millrace::tools::commands::recordings
