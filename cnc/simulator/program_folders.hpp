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

/// In bytes; more than a controller would take.
inline constexpr std::int64_t longest_program = std::int64_t{64} << 20U;

/// The text of one file; the reason if it cannot be read. Diagnostics name it as `file` does.
tl::expected<Program, std::string> read_program(const std::filesystem::path& file);

class ProgramFolders : public ProgramSource {
 public:
  explicit ProgramFolders(std::vector<std::filesystem::path> folders);

  /// The first folder that has the file wins, in any case of its letters, as on a TwinCAT
  /// controller, and as it is written rather than otherwise. An absolute name must be beneath one
  /// of them: programs are chosen by whoever reaches the ADS server, and by other programs. So no
  /// link is followed either, and no name taken that begins with a dot (our choice).
  tl::expected<Program, std::string> load(std::string_view name) override;

 private:
  std::vector<std::filesystem::path> folders_;
};

}  // namespace millrace::cnc::simulator
