// millrace stats: load and counters of each instance.
#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/commands/look/look.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::look {

namespace {

using print::Align;

struct StatsOptions : LookOptions {
  using LookOptions::LookOptions;
  std::string what;
};

void print_stats(const std::vector<const bus::KnownInstance*>& instances) {
  print::Table table({{"NAME"},
                      {"INSTANCE"},
                      {"RUNNING", Align::right},
                      {"ANSWERED", Align::right},
                      {"FAILED", Align::right},
                      {"REPEATED", Align::right},
                      {"CANCELLED", Align::right},
                      {"MEAN", Align::right},
                      {"LAST CALL", Align::right}});
  for (const bus::KnownInstance* instance : instances) {
    const fabric::InstanceStatus status = instance->status.value_or(fabric::InstanceStatus{});
    table.add({base::text::safe(instance->identity.name), instance->identity.id.to_string(),
               std::to_string(status.running), std::to_string(status.answered),
               std::to_string(status.failed), std::to_string(status.repeated),
               std::to_string(status.cancelled), print::duration_text(status.mean),
               ago(status.last_call)});
  }
  fmt::print("{}", table.text());
}

int show(const StatsOptions& options) {
  const bus::FabricModel live = options.look();
  const auto instances = live.instances_of(options.what);
  if (options.json) {
    boost::json::array out;
    for (const bus::KnownInstance* instance : instances) {
      boost::json::object object{{"instance", instance->identity.id.to_string()},
                                 {"uuid", print::utf8(instance->identity.uuid)},
                                 {"name", print::utf8(instance->identity.name)}};
      print::put_fields(object, instance->status.value_or(fabric::InstanceStatus{}));
      out.push_back(std::move(object));
    }
    print::print_json(out);
  } else {
    print_stats(instances);
  }
  if (instances.empty() && !options.what.empty()) {
    fmt::print(stderr,
               "millrace: no instance is, or serves, '{}'; 'millrace services' lists them\n",
               options.what);
    return base::program::exit_failed;
  }
  return base::program::exit_done;
}

}  // namespace

void add_stats(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "stats", "Load and counters of each instance", "millrace stats");
  auto options = std::make_shared<StatsOptions>(command);
  command.add_option("WHAT", options->what, "A UUID, an instance or a name; default: all");
  command.callback([options, &chosen] { chosen.run = [options] { return show(*options); }; });
}

}  // namespace millrace::tools::commands::look
