// Where the virtual CNC gets its NC programs from.
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace millrace::cnc::simulator {

struct Program {
  /// As diagnostics name it.
  std::string file;
  /// As it stands in the file, in CP1252.
  std::string text;
};

class ProgramSource {
 public:
  virtual ~ProgramSource() = default;

  /// The program of this name, as a program or an operator writes it; otherwise the reason.
  virtual tl::expected<Program, std::string> load(std::string_view name) = 0;
};

}  // namespace millrace::cnc::simulator
