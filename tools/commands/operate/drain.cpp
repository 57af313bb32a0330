// millrace drain: has instances finish their calls and leave.
#include "tools/commands/operate/operate.hpp"

namespace millrace::tools::commands::operate {

namespace {

struct DrainOptions : OperateOptions {
  using OperateOptions::OperateOptions;
  std::string what;
};

}  // namespace

void add_drain(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(app, "drain", "Have instances finish their calls and leave",
                                     "millrace drain 8d0c4e6a-52f3-4f0e-9d1b-0a4a2f7c9b11");
  auto options = std::make_shared<DrainOptions>(command);
  command
      .add_option("WHAT", options->what, "An instance; a UUID or a name means all of its instances")
      ->required();
  command.callback([options, &chosen] {
    chosen.run = [options] {
      return tell_instances(*options, fabric::CommandKind::drain, options->what);
    };
  });
}

}  // namespace millrace::tools::commands::operate
