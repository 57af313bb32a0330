#include "tools/commands/replay/stepper.hpp"

#include <boost/asio/read_until.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"

namespace millrace::tools::commands::replay {

Stepper::Stepper(const boost::asio::any_io_executor& executor, const tools::replay::Plan& plan)
    : plan_(plan), input_(executor) {
  boost::system::error_code error;
  // A copy: closing it leaves standard input as it is.
  input_.assign(::dup(STDIN_FILENO), error);
  if (error) {
    throw base::program::UsageError(
        "--step: standard input is neither a terminal nor a pipe, so Enter cannot be pressed");
  }
}

void Stepper::ask(tools::replay::Player& player, const std::function<void()>& stop) {
  const auto next = player.upcoming();
  if (!next || asking_) {
    return;
  }
  asking_ = true;
  const tools::replay::PlannedCall& call = plan_.calls[*next];
  fmt::print(stderr, "next: call {} of {}, {} state {} of {} to {}; Enter issues it, q ends\n",
             *next + 1, plan_.calls.size(), base::text::quoted(call.text), call.state,
             base::text::safe(call.channel.to_string()), base::text::safe(call.uuid));
  boost::asio::async_read_until(
      input_, boost::asio::dynamic_buffer(line_), '\n',
      [this, &player, stop](const boost::system::error_code& error, std::size_t size) {
        const bool quit = error || line_.starts_with('q');
        line_.erase(0, size);
        asking_ = false;
        if (quit) {
          stop();
        } else {
          player.allow();
        }
      });
}

}  // namespace millrace::tools::commands::replay
