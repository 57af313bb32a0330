// The common parts of replays that issue calls: waiting at the start, signals, progress, report.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>

#include "tools/commands/replay/replay.hpp"
#include "tools/commands/replay/report.hpp"
#include "tools/replay/plan.hpp"
#include "tools/replay/player.hpp"
#include "tools/replay/to_services.hpp"

namespace millrace::tools::commands::replay {

// --step: prints the next call, and issues it when Enter is pressed.

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

class ReplayRun : public tools::replay::ReplayListener {
 public:
  /// Both outlive the run.
  ReplayRun(const Options& options, const tools::replay::Plan& plan, tools::replay::Side side);

  [[nodiscard]] boost::asio::io_context& io() { return io_; }

  /// Runs until `missing` names nothing, --wait is over or a signal comes. In the last two cases it
  /// prints what is missing and returns false. With --wait 0 it does not wait.
  bool wait_until_there(const std::function<std::vector<std::string>()>& missing);
  /// Runs the player that `play` has started to its end; returns the exit code.
  int play(tools::replay::Player& player);

  void on_outcome(const tools::replay::Outcome& outcome) override;
  void on_done() override { io_.stop(); }

 private:
  void stop(const std::string& reason);

  const Options& options_;
  boost::asio::io_context io_{1};
  boost::asio::signal_set signals_;
  Progress progress_;
  Report report_;
  std::optional<Stepper> stepper_;
  tools::replay::Player* player_ = nullptr;
  /// Why it ended before its end.
  std::string ended_;
  bool interrupted_ = false;
};

}  // namespace millrace::tools::commands::replay
