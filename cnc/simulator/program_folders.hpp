// NC programs in folders of this host.
//
//   ProgramFolders programs({"nc", "nc/cycles"});
//   auto program = programs.load("square_root.nc");
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "cnc/simulator/program_source.hpp"

namespace millrace::cnc::simulator {

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

}  // namespace millrace::cnc::simulator
