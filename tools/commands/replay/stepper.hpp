// --step: prints the next call, and issues it when Enter is pressed.
#pragma once

#include <functional>
#include <string>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>

#include "tools/replay/plan.hpp"
#include "tools/replay/player.hpp"

namespace millrace::tools::commands::replay {

class Stepper {
 public:
  /// Throws UsageError if standard input is neither a terminal nor a pipe. `plan` outlives it.
  Stepper(const boost::asio::any_io_executor& executor, const tools::replay::Plan& plan);

  /// Asks for the player's next call, if there is one and it was not asked for yet. Calls `stop` at
  /// the end of the input, or for "q".
  void ask(tools::replay::Player& player, const std::function<void()>& stop);

 private:
  const tools::replay::Plan& plan_;
  boost::asio::posix::stream_descriptor input_;
  std::string line_;
  bool asking_ = false;
};

}  // namespace millrace::tools::commands::replay
