// millrace drain: has instances finish their calls and leave.
#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/operate/operate.hpp"

namespace millrace::tools::commands::operate {

namespace {

struct DrainOptions : OperateOptions {
  using OperateOptions::OperateOptions;
  std::string what;
};

/// Services that have an instance now and will have none.
std::map<std::string, std::string> services_that_end(const bus::FabricModel& live,
                                                     const std::string& what) {
  std::set<fabric::InstanceId> leaving;
  for (const bus::KnownInstance* instance : live.instances_of(what)) {
    leaving.insert(instance->identity.id);
  }
  std::map<std::string, std::string> ending;
  for (const bus::KnownInstance* instance : live.instances_of(what)) {
    const auto others = live.instances_of(instance->identity.uuid);
    const bool is_last = std::ranges::all_of(others, [&](const bus::KnownInstance* other) {
      return leaving.contains(other->identity.id) || other->identity.draining;
    });
    if (is_last && !instance->identity.draining) {
      ending.emplace(instance->identity.uuid, instance->identity.name);
    }
  }
  return ending;
}

int drain(const DrainOptions& options) {
  const bus::FabricModel live = bus::take_snapshot(options.fabric.options());
  const int code = tell_instances(options, live, fabric::CommandKind::drain, options.what);
  if (!options.what.empty()) {
    for (const auto& [uuid, name] : services_that_end(live, options.what)) {
      fmt::print(stderr,
                 "millrace: {} ({}) has no other instance: its calls wait until one is started\n",
                 base::text::safe(name), base::text::safe(uuid));
    }
  }
  return code;
}

}  // namespace

void add_drain(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(app, "drain", "Have instances finish their calls and leave",
                                     "millrace drain 8d0c4e6a-52f3-4f0e-9d1b-0a4a2f7c9b11");
  auto options = std::make_shared<DrainOptions>(command);
  command
      .add_option("WHAT", options->what, "An instance; a UUID or a name means all of its instances")
      ->required();
  command.callback([options, &chosen] { chosen.run = [options] { return drain(*options); }; });
}

}  // namespace millrace::tools::commands::operate
