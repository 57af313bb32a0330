#include "tools/commands/watch/watch.hpp"

#include <csignal>
#include <cstdio>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "base/program/number_range.hpp"
#include "fabric/observer/observer.hpp"
#include "fabric/profile/command_line.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/watch/board.hpp"
#include "tools/commands/watch/screen.hpp"
#include "tools/print/call_text.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::watch {

namespace {

namespace program = base::program;

/// How often the terminal is redrawn.
constexpr auto refresh = std::chrono::milliseconds(250);

struct Options {
  explicit Options(CLI::App& command) : fabric(command, {.name = "millrace watch"}) {}

  fabric::profile::FabricFlags fabric;
  recording::Filter filter;
  std::uint64_t count = 0;
  bool lines = false;
  bool json = false;
};

class Watch : public fabric::observer::ObserverListener {
 public:
  Watch(fabric::dds::Participant& participant, const Options& options)
      : options_(options),
        timer_(io_),
        signals_(io_, SIGINT, SIGTERM),
        observer_(participant, io_.get_executor(), *this, fabric::observer::Interest::everything) {
    if (!options.json && !options.lines && output_is_terminal()) {
      screen_.emplace();
    }
  }

  /// Until a signal, or until as many calls as were asked for have ended.
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
    if (const auto call = follower_.add(entry)) {
      show(*call, entry.at);
      if (++seen_ == options_.count) {
        io_.stop();
      }
    }
  }

 private:
  void show(const recording::FollowedCall& call, fabric::Time now) {
    if (screen_) {
      board_.add(call, now);
    } else if (options_.json) {
      print::print_json(print::json_of(call));
    } else {
      fmt::print("{}\n", print::line_of(call));
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
    // The line behind the last one would scroll.
    Screen::draw(board_.text(live_, follower_, now, size.rows - 1, size.columns));
    timer_.expires_after(refresh);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) {
        draw();
      }
    });
  }

  const Options& options_;
  std::optional<Screen> screen_;
  bus::FabricModel live_;
  recording::CallFollower follower_;
  Board board_;
  std::uint64_t seen_ = 0;
  boost::asio::io_context io_{1};
  boost::asio::steady_timer timer_;
  boost::asio::signal_set signals_;
  fabric::observer::Observer observer_;
};

int watch(const Options& options) {
  fabric::dds::Participant participant(options.fabric.options());
  Watch(participant, options).run();
  return program::exit_done;
}

}  // namespace

void add_watch(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "watch", "Show each call as one line; on a terminal a table with rates",
                     "millrace watch --channel 1\n"
                     "  millrace watch --json --count 100 | jq .duration_ms");
  auto options = std::make_shared<Options>(command);
  add_filter(command, options->filter);
  command.add_option("--count", options->count, "End after this number of calls")
      ->check(base::program::positive_number());
  command.add_flag("--lines", options->lines, "Lines also on a terminal");
  add_json(command, options->json);
  command.callback([options, &chosen] { chosen.run = [options] { return watch(*options); }; });
}

}  // namespace millrace::tools::commands::watch
