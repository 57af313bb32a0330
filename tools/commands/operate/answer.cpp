// millrace answer: answers a pending call instead of the service.
#include "base/program/command_line.hpp"
#include "base/text/cp1252.hpp"
#include "tools/commands/operate/operate.hpp"

namespace millrace::tools::commands::operate {

namespace {

struct AnswerOptions : OperateOptions {
  using OperateOptions::OperateOptions;
  fabric::ChannelKey key;
  std::string response;
  std::uint32_t state = 0;
};

int answer(const AnswerOptions& options) {
  const auto text = base::text::to_cp1252(options.response);
  if (!text) {
    throw base::program::UsageError("the response cannot be sent to a controller: " + text.error());
  }
  if (text->size() > fabric::max_text) {
    throw base::program::UsageError("the response has " + std::to_string(text->size()) +
                                    " bytes; a controller's string holds 127");
  }
  fabric::Command command = new_command(fabric::CommandKind::answer);
  command.text = *text;
  command.state = options.state;
  return tell_gateway(options, options.key, std::move(command));
}

}  // namespace

void add_answer(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "answer", "Answer the pending call of a channel instead of the service",
                     "millrace answer cnc/1 \"not available\" --state 99");
  auto options = std::make_shared<AnswerOptions>(command);
  add_channel_key(command, options->key);
  command.add_option("RESPONSE", options->response, "V.G.SERVICE.RESPONSE, at most 127 bytes")
      ->required();
  command.add_option("--state", options->state, "V.G.SERVICE.RESPONSE_STATE, not 0")
      ->check(base::program::positive_number())
      ->required();
  run_if_chosen(command, chosen, options, answer);
}

// millrace retry: dispatches a pending call again.

namespace {

struct RetryOptions : OperateOptions {
  using OperateOptions::OperateOptions;
  fabric::ChannelKey key;
};

}  // namespace

void add_retry(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "retry", "Retry the pending call of a channel", "millrace retry cnc/1");
  auto options = std::make_shared<RetryOptions>(command);
  add_channel_key(command, options->key);
  run_if_chosen(command, chosen, options, [](const auto& wanted) {
    return tell_gateway(wanted, wanted.key, new_command(fabric::CommandKind::retry));
  });
}

}  // namespace millrace::tools::commands::operate
