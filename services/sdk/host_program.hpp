// A process with the services of a configuration file: its command line and its participant.
//
//   std::string file = "http.textproto";
//   HostProgram program("Answers calls with URLs", "http", [&](CLI::App& app) {
//     app.add_option("--config", file, "…"); });
//   return program.run(argc, argv, [&](const HostedProcess& process) { …; return exit_done; });
//
// A process with one service of its own uses services/sdk/command_line.hpp.
#pragma once

#include <functional>
#include <string>

#include "base/program/command_line.hpp"
#include "base/program/log.hpp"
#include "fabric/messages.hpp"
#include "fabric/profile/command_line.hpp"
#include "services/sdk/announcement.hpp"
#include "services/sdk/service.hpp"

namespace millrace::services::sdk {

/// The process after its command line was parsed.
struct HostedProcess {
  /// Of the process in logs; its services have their own names.
  std::string name;
  base::program::Log log;
  fabric::dds::ParticipantOptions join;

  /// The options that all services of the process share: its version, and one participant, which
  /// joins the fabric now. Throws std::runtime_error if the fabric cannot be joined.
  [[nodiscard]] ServiceOptions services() const;
};

/// Who reports the alarms of the process, in which no service may run.
fabric::InstanceIdentity identity_of_process(const std::string& name);

/// Those of one of these services.
ServiceOptions options_of(const Announcement& announcement, ServiceOptions shared);

/// The flags of `add`, then --check, --name, --log-level and those of the fabric.
class HostProgram {
 public:
  HostProgram(const std::string& title, std::string name,
              const std::function<void(CLI::App&)>& add);

  /// To add further flags before run().
  [[nodiscard]] CLI::App& app() { return app_; }

  /// Returns an exit code of base/program/command_line.hpp.
  int run(int argc, char** argv, const std::function<int(const HostedProcess&)>& body);

 private:
  CLI::App app_;
  std::string name_;
  spdlog::level::level_enum level_ = spdlog::level::info;
  fabric::profile::FabricFlags fabric_;
};

}  // namespace millrace::services::sdk
