#include <map>
#include <set>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/checks/checks.hpp"
#include "tools/doctor/checks/words.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

}  // namespace

void at_versions(const Findings& found, Report& report) {
  for (const auto& [key, status] : found.live.machines()) {
    if (!status.version.empty() && status.version != found.joining.version) {
      report.warning(fmt::format("the gateway of {} is millrace {}, this is millrace {}",
                                 safe(status.machine), safe(status.version), found.joining.version),
                     "install one version on all hosts");
    }
  }
  std::map<std::string, std::set<std::string>> versions;
  for (const auto& [id, instance] : found.live.instances()) {
    versions[instance.identity.uuid].insert(instance.identity.version);
  }
  for (const auto& [uuid, all] : versions) {
    if (all.size() > 1) {
      report.warning(fmt::format("the instances of {} have versions {}", safe(uuid), list_of(all)),
                     "normal during an upgrade; otherwise drain the old instances");
    }
  }
}

}  // namespace millrace::tools::doctor::checks
