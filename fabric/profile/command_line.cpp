#include "fabric/profile/command_line.hpp"

#include <cstdlib>

#include <fmt/format.h>

#include "fabric/dds/trust_watch.hpp"

namespace millrace::fabric::profile {

namespace program = base::program;

namespace {

dds::ParticipantOptions read(const std::string& file, const dds::ParticipantOptions& defaults) {
  if (file.empty()) {
    return defaults;
  }
  auto options = read_profile(file);
  if (!options) {
    throw program::UsageError(options.error());
  }
  options->name = defaults.name;
  if (options->trust) {
    auto trust = std::make_shared<dds::Trust>(*options->trust);
    trust->ended = [](const std::string& reason) {
      program::give_up(
          fmt::format("{}: from now on no process on the fabric accepts what this one publishes. "
                      "Put newer credentials into its folder (`millrace trust renew`, or `issue` "
                      "under another name where the certificate was revoked) and start it again",
                      reason));
    };
    trust->needs_new_participant = [](const std::string& reason) {
      program::give_up(
          fmt::format("{}: ending, so that a supervisor starts this process again", reason));
    };
    options->trust = std::move(trust);
  }
  return *options;
}

}  // namespace

FabricFlags::FabricFlags(CLI::App& app, dds::ParticipantOptions defaults,
                         std::filesystem::path of_host)
    : defaults_(std::move(defaults)), of_host_(std::move(of_host)) {
  app.add_option(
         "--fabric-config", file_,
         fmt::format("Interface, peers and domain of the fabric (fabric.textproto); default "
                     "{}, if it exists. Without a file nothing leaves this host",
                     of_host_.string()))
      ->type_name("FILE")
      ->group("Fabric")
      ->envname("MILLRACE_FABRIC_CONFIG")
      ->check(CLI::ExistingFile);
  app.add_option(
         "--domain", domain_,
         fmt::format("DDS domain to join; overrides the file; default {}", defaults_.domain))
      ->group("Fabric")
      ->envname("MILLRACE_DOMAIN")
      ->check(CLI::Range(0U, last_domain));
  app.add_option("--fabric", fabric_,
                 fmt::format("Fabric to join within the domain; overrides the file; default {}",
                             defaults_.fabric))
      ->group("Fabric")
      ->envname("MILLRACE_FABRIC");
}

std::string FabricFlags::file() const {
  return file_.empty() ? profile_to_read(std::getenv("MILLRACE_FABRIC_CONFIG"), of_host_) : file_;
}

dds::ParticipantOptions FabricFlags::options() const {
  dds::ParticipantOptions options = read(file(), defaults_);
  options.domain = domain_.value_or(options.domain);
  options.fabric = fabric_.value_or(options.fabric);
  if (!dds::is_fabric_name(options.fabric)) {
    throw program::UsageError(fmt::format(
        "--fabric {}: expected some text without '*', '?', '/' and ','", options.fabric));
  }
  return options;
}

}  // namespace millrace::fabric::profile
