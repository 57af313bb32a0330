#include "tools/commands/data/listen.hpp"

#include <csignal>
#include <cstdio>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/program/number_range.hpp"
#include "base/text/quoted.hpp"
#include "fabric/observer/observer.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/names.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::data {

namespace {

using OnEntry = std::function<bool(const recording::Entry&)>;

class Listener : public fabric::observer::ObserverListener {
 public:
  Listener(fabric::dds::Participant& participant, fabric::observer::Interest interest,
           std::optional<std::chrono::nanoseconds> wait, const OnEntry& on_entry)
      : on_entry_(on_entry),
        timer_(io_),
        signals_(io_, SIGINT, SIGTERM),
        observer_(participant, io_.get_executor(), *this, interest) {
    signals_.async_wait([this](const boost::system::error_code&, int) { io_.stop(); });
    if (wait) {
      timer_.expires_after(*wait);
      timer_.async_wait([this](const boost::system::error_code&) { io_.stop(); });
    }
  }

  void run() { io_.run(); }

  void on_entry(recording::Entry entry) override {
    if (!io_.stopped() && !on_entry_(entry)) {
      io_.stop();
    }
  }

 private:
  const OnEntry& on_entry_;
  boost::asio::io_context io_{1};
  boost::asio::steady_timer timer_;
  boost::asio::signal_set signals_;
  fabric::observer::Observer observer_;
};

}  // namespace

DataOptions::DataOptions(CLI::App& command, const std::string& what)
    : fabric(command, {.name = "millrace"}), wait(bus::Patience{}.at_least) {
  constexpr std::uint16_t last_channel = 255;
  command.add_option("MACHINE", machine, "Only this machine; default: all");
  command.add_option("--channel", channel, "Only this channel, counted from 1")
      ->check(CLI::Range(std::uint16_t{1}, last_channel));
  command.add_flag("--watch", watch, "Continue, with one line for each " + what);
  command.add_option("--count", count, "With --watch: end after this number of lines")
      ->check(base::program::positive_number());
  add_duration(command, "--wait", wait, "Listen for this time; default 700ms");
  add_json(command, json);
}

bool DataOptions::takes(const fabric::ChannelKey& key) const {
  return (machine.empty() || machine == key.machine) && (channel == 0 || channel == key.channel);
}

std::string why(const std::string& reason, bool replayed) {
  return base::text::safe(reason) + (replayed ? (reason.empty() ? "replayed" : ", replayed") : "");
}

void listen(const fabric::dds::ParticipantOptions& fabric, fabric::observer::Interest interest,
            std::optional<std::chrono::nanoseconds> wait, const OnEntry& on_entry) {
  fabric::dds::Participant participant(fabric);
  Listener(participant, interest, wait, on_entry).run();
}

void listen(const DataOptions& options, const OnEntry& on_entry) {
  listen(options.fabric.options(), fabric::observer::Interest::data,
         options.watch ? std::nullopt : std::optional(options.wait), on_entry);
}

int say_unknown_machine(const DataOptions& options) {
  Names known;
  const bus::FabricModel live = bus::take_snapshot(options.fabric.options());
  for (const auto& [key, status] : live.machines()) {
    known.push_back(key.first);
  }
  return std::ranges::find(known, options.machine) != known.end()
             ? print_unknown("such data of machine", options.machine, {}, options.fabric.options())
             : print_unknown("machine", options.machine, std::move(known),
                             options.fabric.options());
}

std::string ago(fabric::Time time) {
  const auto age = std::chrono::system_clock::now() - time;
  return time == fabric::Time{} ? "-" : print::age_text(std::max(age, decltype(age)::zero()));
}

int follow(const DataOptions& options, const OnEntry& wanted) {
  std::uint64_t seen = 0;
  listen(options, [&](const recording::Entry& entry) {
    if (!wanted(entry)) {
      return true;
    }
    if (options.json) {
      print::print_json(print::json_of(entry));
    } else {
      fmt::print("{}\n", print::line_of(entry));
    }
    return std::fflush(stdout) == 0 && ++seen != options.count;
  });
  return base::program::exit_done;
}

}  // namespace millrace::tools::commands::data
