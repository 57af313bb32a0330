// millrace retry: dispatches a pending call again.
#include "tools/commands/operate/operate.hpp"

namespace millrace::tools::commands::operate {

namespace {

struct RetryOptions : OperateOptions {
  using OperateOptions::OperateOptions;
  fabric::ChannelKey key;
};

}  // namespace

void add_retry(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(app, "retry", "Dispatch the pending call of a channel again",
                                     "millrace retry cnc/1");
  auto options = std::make_shared<RetryOptions>(command);
  add_channel_key(command, options->key);
  command.callback([options, &chosen] {
    chosen.run = [options] {
      return tell_gateway(*options, options->key, new_command(fabric::CommandKind::retry));
    };
  });
}

}  // namespace millrace::tools::commands::operate
