#include "services/sdk/host_program.hpp"

#include <unistd.h>

#include "base/posix/system.hpp"
#include "base/program/version.hpp"
#include "services/sdk/shared_participant.hpp"

namespace millrace::services::sdk {

namespace program = base::program;

ServiceOptions HostedProcess::services() const {
  return {.version = program::version(),
          .participant = std::make_shared<SharedParticipant>(join, log)};
}

fabric::InstanceIdentity identity_of_process(const std::string& name) {
  return {.id = fabric::InstanceId::random(),
          .name = name,
          .host = base::posix::host_name(),
          .pid = static_cast<std::uint32_t>(::getpid())};
}

ServiceOptions options_of(const Announcement& announcement, ServiceOptions shared) {
  shared.uuid = announcement.uuid;
  shared.name = announcement.name;
  shared.description = announcement.description;
  if (!announcement.version.empty()) {
    shared.version = announcement.version;
  }
  shared.channels = announcement.channels;
  shared.delivery = announcement.delivery;
  shared.concurrency = announcement.concurrency;
  return shared;
}

namespace {

/// The flags in the order of the help.
CLI::App& with_flags(CLI::App& app, const std::function<void(CLI::App&)>& add, std::string& name,
                     spdlog::level::level_enum& level) {
  add(app);
  program::add_check(app);
  app.add_option("--name", name, "Name of this process in logs; its services have their own")
      ->capture_default_str();
  program::add_log_level(app, level);
  return app;
}

}  // namespace

HostProgram::HostProgram(const std::string& title, std::string name,
                         const std::function<void(CLI::App&)>& add)
    : app_(title), name_(std::move(name)), fabric_(with_flags(app_, add, name_, level_)) {}

int HostProgram::run(int argc, char** argv, const std::function<int(const HostedProcess&)>& body) {
  return program::run(app_, argc, argv, [&] {
    return body(
        {.name = name_, .log = program::make_log(name_, level_), .join = fabric_.options()});
  });
}

}  // namespace millrace::services::sdk
