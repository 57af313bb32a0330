// The command line that all services share.
//
//   int main(int argc, char** argv) {
//     ServiceProgram program({.uuid = "…", .name = "archiver"});
//     std::string folder;
//     program.app().add_option("--folder", folder, "Where archives go")->required();
//     return program.run(argc, argv, [&] { return archive_into(folder); });
//   }
//
// A service without flags of its own uses services/sdk/main.hpp.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/program/command_line.hpp"
#include "base/program/log.hpp"
#include "fabric/profile/command_line.hpp"
#include "services/sdk/alarms.hpp"
#include "services/sdk/service.hpp"

namespace millrace::services::sdk {

/// A process with one service: --uuid, --channel, --name, --concurrency, --delivery, the flags of
/// fabric/profile/command_line.hpp and --log-level, with the given options as defaults.
class ServiceProgram {
 public:
  explicit ServiceProgram(ServiceOptions defaults);

  /// To add flags before run().
  [[nodiscard]] CLI::App& app() { return app_; }
  /// The options after the command line was applied to the defaults; complete once run() calls
  /// `make`.
  [[nodiscard]] const ServiceOptions& options() const { return options_; }
  /// For a further participant of the process, with this name; likewise.
  [[nodiscard]] fabric::dds::ParticipantOptions join_as(std::string name) const;
  /// The flags of the fabric, as fabric::profile::given_flags(); likewise.
  [[nodiscard]] std::string given_flags() const;
  /// To standard error under the service's name; for `make` and the handler.
  [[nodiscard]] const Service::Log& log() const { return log_; }
  /// The alarms of the service; for `make` and the handler. On the fabric while it serves.
  [[nodiscard]] Alarms& alarms() { return alarms_; }

  /// Parses the command line, creates the handler (which may throw program::UsageError), serves,
  /// prints one ready line, and leaves on SIGTERM or SIGINT when the running calls are answered; a
  /// second signal ends the process at once. Returns an exit code of base/program/command_line.hpp.
  int run(int argc, char** argv, const std::function<Handler()>& make);
  int run(int argc, char** argv, const std::function<AsyncHandler()>& make);

 private:
  /// Throws UsageError without a UUID.
  void expect_uuid() const;
  void take_channels();
  [[nodiscard]] std::unique_ptr<Service> open(AsyncHandler handler);
  void take_fabric();

  ServiceOptions options_;
  CLI::App app_;
  fabric::profile::FabricFlags fabric_;
  spdlog::level::level_enum level_ = spdlog::level::info;
  std::vector<std::string> channels_;
  Service::Log log_;
  Alarms alarms_;
};

}  // namespace millrace::services::sdk
