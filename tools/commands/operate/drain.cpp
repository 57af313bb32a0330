// millrace drain: makes instances finish their calls and leave.
#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/names.hpp"
#include "tools/commands/operate/operate.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::operate {

namespace {

struct DrainOptions : OperateOptions {
  using OperateOptions::OperateOptions;
  std::string what;
  bool confirmed = false;
};

/// Services that have an instance now and will have none without `leaving`.
std::map<std::string, std::string> services_that_end(const fabric::plant::Plant& live,
                                                     const Instances& leaving) {
  std::map<std::string, std::string> ending;
  for (const fabric::InstanceIdentity& instance : leaving) {
    const auto others = live.instances_of(instance.uuid);
    const bool is_last =
        std::ranges::all_of(others, [&](const fabric::plant::KnownInstance* other) {
          return other->identity.draining ||
                 std::ranges::find(leaving, other->identity.id, &fabric::InstanceIdentity::id) !=
                     leaving.end();
        });
    if (is_last && !instance.draining) {
      ending.emplace(instance.uuid, instance.name);
    }
  }
  return ending;
}

/// An exact UUID, name or id stands for its instances alone; a beginning for all that begin so, if
/// that is one, or if the operator has confirmed them.
Instances instances_to_drain(const fabric::plant::Plant& live, const std::string& what,
                             bool confirmed) {
  Instances exact;
  Instances all;
  std::vector<std::string> names;
  for (const fabric::plant::KnownInstance* instance : instances_named(live, what)) {
    all.push_back(instance->identity);
    names.push_back(fmt::format("{} ({}, instance {})", base::text::safe(instance->identity.name),
                                base::text::safe(instance->identity.uuid),
                                instance->identity.id.to_string()));
    if (match(names_of(*instance), what) == Match::exact) {
      exact.push_back(instance->identity);
    }
  }
  if (!exact.empty()) {
    return exact;
  }
  if (all.size() > 1 && !confirmed) {
    throw base::program::UsageError(
        fmt::format("'{}' is the beginning of {} instances: {}; give one exactly, or --yes to "
                    "drain all of them",
                    what, all.size(), fmt::join(names, ", ")));
  }
  return all;
}

int drain(const DrainOptions& options) {
  const fabric::plant::Plant live = bus::take_snapshot(options.fabric.options());
  const Instances leaving = instances_to_drain(live, options.what, options.confirmed);
  if (leaving.empty()) {
    return print_unknown_service(options.what, live, options.fabric.options());
  }
  const Answers answers =
      send_to_each(options.fabric, options.timeout, fabric::CommandKind::drain, leaving);
  if (options.json) {
    print::print_json(json_of(leaving, answers));
  } else {
    fmt::print("{}", answers_text(leaving, answers));
  }
  for (const auto& [uuid, name] : services_that_end(live, leaving)) {
    fmt::print(stderr,
               "millrace: {} ({}) has no other instance: its calls wait until one is started\n",
               base::text::safe(name), base::text::safe(uuid));
  }
  return std::ranges::all_of(answers, &is_done) ? base::program::exit_done
                                                : base::program::exit_failed;
}

}  // namespace

void add_drain(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(app, "drain", "Let instances finish their calls and exit",
                                     "millrace drain 8d0c4e6a-52f3-4f0e-9d1b-0a4a2f7c9b11");
  auto options = std::make_shared<DrainOptions>(command);
  command
      .add_option("WHAT", options->what,
                  "An instance; a UUID or a name means all of its instances. The "
                  "beginning is enough if only one has it")
      ->required();
  command.add_flag("--yes", options->confirmed, "Drain all instances that begin with WHAT");
  run_if_chosen(command, chosen, options, drain);
}

}  // namespace millrace::tools::commands::operate
