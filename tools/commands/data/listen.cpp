#include "tools/commands/data/listen.hpp"

#include <csignal>
#include <cstdio>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "fabric/observer/observer.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/data/listings.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"

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
    : fabric(command, {.name = "millrace"}), output(command), wait(bus::Patience{}.at_least) {
  constexpr std::uint16_t last_channel = 255;
  command.add_option("MACHINE", machine, "Only this machine; default: all");
  command.add_option("--channel", channel, "Only this channel, counted from 1")
      ->check(CLI::Range(std::uint16_t{1}, last_channel));
  output.exclude(
      command.add_flag("-f,--follow", follows, "Continue, with one line for each " + what));
  command.add_option("--count", count, "With -f: end after this number of lines")
      ->check(base::program::positive_number());
  add_duration(command, "--wait", wait, "Listen for this time; default 700ms");
}

bool DataOptions::takes(const fabric::ChannelKey& key) const {
  return (machine.empty() || machine == key.machine) && (channel == 0 || channel == key.channel);
}

int DataOptions::report_no_data(const Names& known) const {
  if (std::ranges::find(known, machine) == known.end()) {
    return print_unknown("machine", machine, known, fabric.options());
  }
  fmt::print(stderr,
             "millrace: machine '{}' publishes no such data; data, programs and queue in the "
             "configuration of its gateway select it\n",
             machine);
  return base::program::exit_failed;
}

void listen(const fabric::dds::ParticipantOptions& fabric, fabric::observer::Interest interest,
            std::optional<std::chrono::nanoseconds> wait, const OnEntry& on_entry) {
  fabric::dds::Participant participant(fabric);
  Listener(participant, interest, wait, on_entry).run();
}

int follow(const DataOptions& options, const Wanted& wanted) {
  std::uint64_t seen = 0;
  listen(options.fabric.options(), fabric::observer::Interest::data, std::nullopt,
         [&](const recording::Entry& entry) {
           if (!wanted(entry)) {
             return true;
           }
           if (options.output.json) {
             print::print_json(print::json_of(entry));
           } else {
             fmt::print("{}\n", print::line_of(entry));
           }
           return std::fflush(stdout) == 0 && ++seen != options.count;
         });
  return base::program::exit_done;
}

Received receive(const DataOptions& options, const Wanted& wanted) {
  LastEntries last;
  Names machines;
  const auto interest = options.machine.empty() ? fabric::observer::Interest::data
                                                : fabric::observer::Interest::everything;
  listen(options.fabric.options(), interest, options.wait, [&](const recording::Entry& entry) {
    if (wanted(entry)) {
      last.add(entry);
    } else if (const auto* status = std::get_if<fabric::MachineStatus>(&entry.sample)) {
      machines.push_back(status->machine);
    }
    return true;
  });
  return {last.rows(), std::move(machines)};
}

}  // namespace millrace::tools::commands::data
