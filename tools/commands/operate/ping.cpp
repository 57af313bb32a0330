// millrace ping: asks instances whether they are there.
#include "tools/bus/snapshot.hpp"
#include "tools/commands/operate/operate.hpp"

namespace millrace::tools::commands::operate {

namespace {

struct PingOptions : OperateOptions {
  using OperateOptions::OperateOptions;
  std::string what;
};

}  // namespace

void add_ping(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "ping", "Ask instances whether they run; each one responds",
                     "millrace ping 560aacbf-6335-44a9-895a-8b27f3ed5e47");
  auto options = std::make_shared<PingOptions>(command);
  command
      .add_option("WHAT", options->what,
                  "A UUID, an instance or a name; of a UUID or a name, all instances are asked")
      ->required();
  command.callback([options, &chosen] {
    chosen.run = [options] {
      const bus::FabricModel live = bus::take_snapshot(options->fabric.options());
      return tell_instances(*options, live, fabric::CommandKind::ping, options->what);
    };
  });
}

}  // namespace millrace::tools::commands::operate
