// Files of this host that a virtual CNC reads and writes: NC programs, reports, routes.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "base/program/log.hpp"
#include "cnc/ads/routes.hpp"
#include "cnc/nc/event.hpp"
#include "cnc/simulator/program_control.hpp"

namespace millrace::cnc::simulator {

// NC programs in folders of this host.
//
//   ProgramFolders programs({"nc", "nc/cycles"});
//   auto program = programs.load("square_root.nc");

/// In bytes; more than a controller would accept.
inline constexpr std::int64_t longest_program = std::int64_t{64} << 20U;

/// The text of one file, or the reason why it cannot be read. Diagnostics contain the name `file`.
tl::expected<Program, std::string> read_program(const std::filesystem::path& file);

class ProgramFolders : public ProgramSource {
 public:
  explicit ProgramFolders(std::vector<std::filesystem::path> folders);

  /// Loads the file from the first folder that has it. Names are case-insensitive, as on a TwinCAT
  /// controller; an exact match wins. An absolute name must be beneath one of the folders, since
  /// any ADS client and any NC program may choose a name. For the same reason links are not
  /// followed, and names that begin with a dot are refused (our choice).
  tl::expected<Program, std::string> load(std::string_view name) override;

 private:
  std::vector<std::filesystem::path> folders_;
};

// Report files of #MSG SAVE: NC programs append lines to files in one folder
// (IB/tf5200_programming_manual/207171211, documented).
//
//   ReportFiles files("/var/lib/cnc");
//   files.append({"message.txt", "part 7 done", true, true}, std::chrono::system_clock::now());
//   → 2026-03-01 07:00:00.123 part 7 done

class ReportFiles {
 public:
  explicit ReportFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Appends the text of the NC program unchanged, in CP1252, or returns why that failed. Refuses a
  /// file outside the folder, also through a link, and a name that begins with a dot (our choice).
  /// The time stamp is local time; it and the text stand without quotation marks (our choice: the
  /// manual does not document the form of the stamp, and prints its example with them).
  tl::expected<void, std::string> append(const nc::SaveEvent& saved,
                                         std::chrono::system_clock::time_point now);

 private:
  std::filesystem::path folder_;
};

// The routes that clients have added to a virtual CNC, in a file:
//
//   192.168.10.20.1.1 AB:CD:…

/// Reads the routes of the file; each added route is logged, and the file is rewritten. An empty
/// path = no file. A missing file counts as empty. Throws std::runtime_error for a malformed line
/// and for a file that cannot be read.
std::shared_ptr<ads::Routes> read_routes(const std::filesystem::path& file,
                                         const base::program::Log& log);

}  // namespace millrace::cnc::simulator
