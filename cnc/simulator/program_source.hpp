// The source of NC programs for the virtual CNC.
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace millrace::cnc::simulator {

struct Program {
  /// Name of the file in diagnostics.
  std::string file;
  /// The contents of the file, in CP1252.
  std::string text;
};

class ProgramSource {
 public:
  virtual ~ProgramSource() = default;

  /// The NC program with this name, as an NC program or an operator writes it, or the reason why it
  /// cannot be loaded.
  virtual tl::expected<Program, std::string> load(std::string_view name) = 0;
};

}  // namespace millrace::cnc::simulator
