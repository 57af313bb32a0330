// Which fabric a process joins, from its command line.
//
//   FabricFlags fabric(app);
//   return program::run(app, argc, argv, [&] { Participant participant(fabric.options()); … });
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "base/program/command_line.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/profile/profile.hpp"

namespace millrace::fabric::profile {

/// --fabric-config FILE, and --domain and --fabric, which override the file; each also from the
/// environment (MILLRACE_FABRIC_CONFIG, MILLRACE_DOMAIN, MILLRACE_FABRIC). Without a named file,
/// that of the host.
class FabricFlags {
 public:
  /// Adds the flags; `defaults` hold where neither flag nor file says otherwise.
  explicit FabricFlags(CLI::App& app, dds::ParticipantOptions defaults = {},
                       std::filesystem::path of_host = host_profile);
  FabricFlags(const FabricFlags&) = delete;
  FabricFlags& operator=(const FabricFlags&) = delete;

  /// Call it after the command line is parsed. Throws program::UsageError with all mistakes of the
  /// file.
  [[nodiscard]] dds::ParticipantOptions options() const;
  /// The file, or empty: for callers that need more than how to join.
  [[nodiscard]] std::string file() const;

 private:
  dds::ParticipantOptions defaults_;
  std::filesystem::path of_host_;
  std::string file_;
  std::optional<std::uint32_t> domain_;
  std::optional<std::string> fabric_;
};

}  // namespace millrace::fabric::profile
