#include "tools/commands/replay/run.hpp"

#include <csignal>

#include <boost/asio/post.hpp>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::replay {

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
    fmt::print(stderr, "millrace: no call was issued; see 'millrace services' and --wait\n");
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
