#include "tools/commands/data/listen.hpp"

#include <csignal>
#include <cstdio>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
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

/// Prints what is wanted.
class Follower : public fabric::observer::ObserverListener {
 public:
  Follower(fabric::dds::Participant& participant, const DataOptions& options, const Wanted& wanted)
      : options_(options),
        wanted_(wanted),
        signals_(io_, SIGINT, SIGTERM),
        observer_(participant, io_.get_executor(), *this, fabric::observer::Interest::data) {
    signals_.async_wait([this](const boost::system::error_code&, int) { io_.stop(); });
  }

  void run() { io_.run(); }

  void on_entry(recording::Entry entry) override {
    if (io_.stopped() || !wanted_(entry)) {
      return;
    }
    if (options_.output.json) {
      print::print_json(print::json_of(entry));
    } else {
      fmt::print("{}\n", print::line_of(entry));
    }
    if (std::fflush(stdout) != 0 || ++seen_ == options_.count) {
      io_.stop();
    }
  }

 private:
  const DataOptions& options_;
  const Wanted& wanted_;
  std::uint64_t seen_ = 0;
  boost::asio::io_context io_{1};
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
  add_duration(command, "--wait", wait, "Without -f: listen for at least this time; default 700ms");
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

int follow(const DataOptions& options, const Wanted& wanted) {
  fabric::dds::Participant participant(options.fabric.options());
  Follower(participant, options, wanted).run();
  return base::program::exit_done;
}

Received receive(const DataOptions& options, const Wanted& wanted) {
  LastEntries last;
  Names machines;
  const auto interest = options.machine.empty() ? fabric::observer::Interest::data
                                                : fabric::observer::Interest::everything;
  bus::listen(options.fabric.options(), bus::patience_of(options.wait), interest,
              [&](const recording::Entry& entry) {
                if (wanted(entry)) {
                  last.add(entry);
                } else if (const auto* status = std::get_if<fabric::MachineStatus>(&entry.sample)) {
                  machines.push_back(status->machine);
                }
              });
  return {last.rows(), std::move(machines)};
}

}  // namespace millrace::tools::commands::data
