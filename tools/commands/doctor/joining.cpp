#include "tools/commands/doctor/joining.hpp"

#include <cstdlib>

#include "base/configuration/config_file.hpp"
#include "idl/fabric.pb.h"

namespace millrace::tools::commands::doctor {

tools::doctor::Joining joining_of(const fabric::profile::FabricFlags& flags,
                                  const fabric::dds::ParticipantOptions& join) {
  tools::doctor::Joining joining{.fabric = join.fabric,
                                 .domain = join.domain,
                                 .cyclone_uri = std::getenv("CYCLONEDDS_URI") != nullptr,
                                 .version = MILLRACE_VERSION};
  if (!flags.file().empty()) {
    const auto profile = base::configuration::read_config<config::Fabric>(flags.file());
    if (!profile) {
      throw base::program::UsageError(profile.error());
    }
    joining.interface = profile->interface();
    joining.multicast = profile->multicast();
    joining.peers.assign(profile->peers().begin(), profile->peers().end());
  }
  return joining;
}

}  // namespace millrace::tools::commands::doctor
