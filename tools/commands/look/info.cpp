// millrace info: all properties of instances.
#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "fabric/words.hpp"
#include "tools/commands/look/look.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::look {

namespace {

struct InfoOptions : LookOptions {
  using LookOptions::LookOptions;
  std::string what;
};

void print_instance(const bus::KnownInstance& instance) {
  const fabric::InstanceIdentity& identity = instance.identity;
  fmt::print("{} {}\n", base::text::safe(identity.name), identity.id.to_string());
  const auto line = [](std::string_view name, const std::string& value) {
    fmt::print("  {:<12} {}\n", name, value);
  };
  line("uuid", base::text::safe(identity.uuid));
  line("description", base::text::safe(identity.description));
  line("version", base::text::safe(identity.version));
  line("host", fmt::format("{}, process {}", base::text::safe(identity.host), identity.pid));
  line("channels", channels_text(identity));
  line("delivery", std::string(fabric::name_of(identity.delivery)));
  line("completion_signal", std::string(fabric::name_of(identity.completion_signal)));
  line("concurrency", std::to_string(identity.concurrency));
  line("draining", identity.draining ? "yes" : "no");
  if (!identity.certificate.empty()) {
    line("certificate", base::text::safe(identity.certificate));
  }
  line("started", instance.status ? ago(instance.status->started) : "-");
}

int show(const InfoOptions& options) {
  const bus::FabricModel live = options.look();
  const auto instances = live.instances_of(options.what);
  boost::json::array out;
  for (const bus::KnownInstance* instance : instances) {
    if (options.json) {
      boost::json::object object;
      print::put_fields(object, instance->identity);
      print::put_time(object, "started",
                      instance->status ? instance->status->started : fabric::Time{});
      out.push_back(std::move(object));
    } else {
      print_instance(*instance);
    }
  }
  if (options.json) {
    print::print_json(out);
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

void add_info(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(app, "info", "All properties of instances",
                                     "millrace info 560aacbf-6335-44a9-895a-8b27f3ed5e47");
  auto options = std::make_shared<InfoOptions>(command);
  command.add_option("WHAT", options->what, "A UUID, an instance or a name; default: all");
  command.callback([options, &chosen] { chosen.run = [options] { return show(*options); }; });
}

}  // namespace millrace::tools::commands::look
