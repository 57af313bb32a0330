// NC programs in folders of this host.
//
//   ProgramFolders programs({"nc", "nc/cycles"});
//   auto program = programs.load("square_root.nc");
#pragma once

#include <filesystem>
#include <vector>

#include "cnc/simulator/program_source.hpp"

namespace millrace::cnc::simulator {

/// The text of one file; the reason if it cannot be read. Diagnostics name it as `file` does.
tl::expected<Program, std::string> read_program(const std::filesystem::path& file);

class ProgramFolders : public ProgramSource {
 public:
  explicit ProgramFolders(std::vector<std::filesystem::path> folders);

  /// The first folder that has the file wins; an absolute name is taken as it is.
  tl::expected<Program, std::string> load(std::string_view name) override;

 private:
  std::vector<std::filesystem::path> folders_;
};

}  // namespace millrace::cnc::simulator
