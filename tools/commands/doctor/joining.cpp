#include "tools/commands/doctor/joining.hpp"

#include <chrono>
#include <cstdlib>

#include "base/configuration/config_file.hpp"
#include "fabric/dds/configuration.hpp"
#include "fabric/profile/credentials.hpp"
#include "idl/fabric.pb.h"

namespace millrace::tools::commands::doctor {

tools::doctor::Joining joining_of(const fabric::profile::FabricFlags& flags,
                                  const fabric::dds::ParticipantOptions& join) {
  tools::doctor::Joining joining{
      .fabric = join.fabric,
      .domain = join.domain,
      .cyclone_uri = fabric::dds::uses_uri(join) && std::getenv("CYCLONEDDS_URI") != nullptr,
      .version = MILLRACE_VERSION};
  if (!flags.file().empty()) {
    const auto profile = base::configuration::read_config<config::Fabric>(flags.file());
    if (!profile) {
      throw base::program::UsageError(profile.error());
    }
    joining.interface = profile->interface();
    joining.multicast = profile->multicast();
    joining.peers.assign(profile->peers().begin(), profile->peers().end());
    if (profile->has_trust()) {
      joining.now = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now());
      const auto credentials = fabric::profile::credentials_of(profile->trust(), flags.file());
      if (!credentials) {
        throw base::program::UsageError(credentials.error());
      }
      joining.trusted_as = credentials->name;
      joining.trusted_until = credentials->until;
      joining.revoked = credentials->revoked;
      joining.revoked_as_of = credentials->revoked_as_of;
    }
  }
  return joining;
}

}  // namespace millrace::tools::commands::doctor
