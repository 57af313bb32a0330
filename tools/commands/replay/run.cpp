#include "tools/commands/replay/run.hpp"

#include <csignal>

#include <boost/asio/post.hpp>
#include <boost/asio/read_until.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "fabric/profile/given_flags.hpp"
#include "tools/print/units.hpp"

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

namespace {

/// Discovery takes a few milliseconds.
constexpr auto settle_time = std::chrono::milliseconds(200);

}  // namespace

ReplayRun::ReplayRun(const Options& options, const tools::replay::Plan& plan,
                     tools::replay::Side side)
    : options_(options),
      signals_(io_, SIGINT, SIGTERM),
      progress_(options.rounds * plan.calls.size()),
      report_(plan,
              {.side = side,
               .tolerances = options.compared(),
               .json = options.json,
               .every = options.step,
               .timed = options.pace().timing == tools::replay::Timing::timed},
              progress_) {
  if (options.step) {
    stepper_.emplace(io_.get_executor(), plan);
  }
  signals_.async_wait([this](const boost::system::error_code& error, int) {
    if (!error) {
      interrupted_ = true;
      stop("interrupted");
    }
  });
}

bool ReplayRun::wait_until_there(const std::function<std::vector<std::string>()>& missing) {
  using Clock = std::chrono::steady_clock;
  if (options_.wait.count() == 0) {
    return true;
  }
  const auto end = Clock::now() + options_.wait;
  std::vector<std::string> names = missing();
  while (!names.empty() && Clock::now() < end && !interrupted_) {
    io_.restart();
    io_.run_one_until(std::min(end, Clock::now() + std::chrono::milliseconds(20)));
    names = missing();
  }
  if (names.empty() && !interrupted_) {
    // Recorders and other observers discover the new endpoints, too.
    io_.restart();
    io_.run_for(settle_time);
  }
  if (interrupted_) {
    fmt::print(stderr, "millrace: interrupted before the first call\n");
    return false;
  }
  for (const std::string& name : names) {
    fmt::print(stderr, "millrace: after {} still missing: {}\n",
               print::duration_text(options_.wait), base::text::safe(name));
  }
  if (!names.empty()) {
    fmt::print(stderr, "millrace: no call was issued; see 'millrace services{}' and --wait\n",
               fabric::profile::given_flags(options_.fabric));
  }
  return names.empty();
}

int ReplayRun::play(tools::replay::Player& player) {
  player_ = &player;
  if (stepper_) {
    stepper_->ask(player, [this] { stop("ended by the operator"); });
  }
  io_.restart();
  io_.run();
  return report_.finish(ended_);
}

void ReplayRun::on_outcome(const tools::replay::Outcome& outcome) {
  report_.add(outcome);
  progress_.show(player_->finished());
  if (stepper_) {
    boost::asio::post(
        io_, [this] { stepper_->ask(*player_, [this] { stop("ended by the operator"); }); });
  }
}

void ReplayRun::stop(const std::string& reason) {
  ended_ = reason;
  if (player_ != nullptr) {
    player_->stop(reason);
  }
}

}  // namespace millrace::tools::commands::replay
