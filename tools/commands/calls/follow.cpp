#include <csignal>
#include <cstdio>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "fabric/observer/observer.hpp"
#include "tools/commands/calls/board.hpp"
#include "tools/commands/calls/calls.hpp"
#include "tools/commands/screen.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::calls {

namespace {

namespace program = base::program;

/// How often the terminal is redrawn.
constexpr auto refresh = std::chrono::milliseconds(250);

class Follower : public fabric::observer::ObserverListener {
 public:
  Follower(fabric::dds::Participant& participant, const CallsOptions& options)
      : options_(options),
        timer_(io_),
        signals_(io_, SIGINT, SIGTERM),
        observer_(participant, io_.get_executor(), *this, fabric::observer::Interest::everything) {
    if (!options.output.json && !options.lines && output_is_terminal()) {
      screen_.emplace();
    }
  }

  /// Until a signal, or until the wanted number of calls has ended.
  void run() {
    signals_.async_wait([this](const boost::system::error_code&, int) { io_.stop(); });
    draw();
    io_.run();
  }

  void on_entry(recording::Entry entry) override {
    const bool wanted = std::holds_alternative<recording::InstanceNews>(entry.sample) ||
                        options_.filter.takes(entry);
    if (!wanted || io_.stopped()) {
      return;
    }
    live_.add(entry);
    names_.add(entry);
    if (const auto call = follower_.add(entry)) {
      show(*call, entry.at);
      if (++seen_ == options_.count) {
        io_.stop();
      }
    }
  }

 private:
  void show(const recording::Call& call, fabric::Time now) {
    const auto instance = names_.of(call.instance());
    if (screen_) {
      board_.add(call, instance, now);
    } else if (options_.output.json) {
      print::print_json(print::json_of(call, instance));
    } else {
      fmt::print("{}\n", print::line_of(call, instance));
    }
    // The reader of a pipe wants each call when it ends.
    if (std::fflush(stdout) != 0) {
      io_.stop();  // The output is closed.
    }
  }

  void draw() {
    if (!screen_) {
      return;
    }
    const auto now = std::chrono::system_clock::now();
    const Screen::Size size = Screen::size();
    // A line after the last one would scroll.
    Screen::draw(board_.text(live_, follower_, now, size.rows - 1, size.columns));
    timer_.expires_after(refresh);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        draw();
      }
    });
  }

  const CallsOptions& options_;
  std::optional<Screen> screen_;
  fabric::plant::Plant live_;
  recording::CallFollower follower_;
  recording::InstanceNames names_;
  Board board_;
  std::uint64_t seen_ = 0;
  boost::asio::io_context io_{1};
  boost::asio::steady_timer timer_;
  boost::asio::signal_set signals_;
  fabric::observer::Observer observer_;
};

}  // namespace

int follow(const CallsOptions& options) {
  fabric::dds::Participant participant(options.fabric.options());
  Follower(participant, options).run();
  return program::exit_done;
}

}  // namespace millrace::tools::commands::calls
