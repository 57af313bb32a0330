// How a program is told which fabric to join.
//
//   FabricFlags fabric(app);
//   return program::run(app, argc, argv, [&] { Participant participant(fabric.options()); … });
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/program/command_line.hpp"
#include "fabric/dds/participant.hpp"

namespace millrace::fabric::profile {

/// --fabric-config FILE (also from the environment, MILLRACE_FABRIC_CONFIG), and --domain and
/// --fabric, which win over the file.
class FabricFlags {
 public:
  /// Adds the flags; `defaults` hold where neither flag nor file says otherwise.
  explicit FabricFlags(CLI::App& app, dds::ParticipantOptions defaults = {});
  FabricFlags(const FabricFlags&) = delete;
  FabricFlags& operator=(const FabricFlags&) = delete;

  /// To be called once the command line is parsed. Throws program::UsageError with every mistake of
  /// the file.
  [[nodiscard]] dds::ParticipantOptions options() const;
  /// The file, or nothing: for who needs to know more of it than how to join.
  [[nodiscard]] const std::string& file() const { return file_; }

 private:
  dds::ParticipantOptions defaults_;
  std::string file_;
  std::optional<std::uint32_t> domain_;
  std::optional<std::string> fabric_;
};

}  // namespace millrace::fabric::profile
