// millrace data: the values that gateways sample.
#include "tools/commands/data/data.hpp"

#include <csignal>
#include <cstdio>
#include <map>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "fabric/observer/observer.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/names.hpp"
#include "tools/print/data.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::data {

namespace {

namespace program = base::program;
using fabric::DataSample;

struct Options : DataOptions {
  explicit Options(CLI::App& command) : DataOptions(command, "sample") {
    command.add_option("--group", groups, "Only this group; may be repeated")
        ->allow_extra_args(false);
  }

  std::vector<std::string> groups;
};

/// By channel and group.
using Samples = std::map<std::pair<fabric::ChannelKey, std::string>, recording::Entry>;

const DataSample* sample_for(const Options& options, const recording::Entry& entry) {
  const auto* sample = std::get_if<DataSample>(&entry.sample);
  const bool wanted = sample != nullptr && options.takes(sample->key) &&
                      (options.groups.empty() ||
                       std::ranges::find(options.groups, sample->group) != options.groups.end());
  return wanted ? sample : nullptr;
}

/// "100 ms", and the configured period if it differs.
std::string period_text(const DataSample& sample) {
  return sample.period == sample.wanted
             ? print::duration_text(sample.wanted)
             : fmt::format("{} (not {})", print::duration_text(sample.period),
                           print::duration_text(sample.wanted));
}

void show_table(const Samples& samples) {
  print::Table table({{"CHANNEL"},
                      {"GROUP"},
                      {"EVERY", print::Align::right},
                      {"VARIABLE"},
                      {"TYPE"},
                      {"VALUE"},
                      {"QUALITY"},
                      {"READ", print::Align::right},
                      {"WHY"}});
  for (const auto& [key, entry] : samples) {
    const auto& sample = std::get<DataSample>(entry.sample);
    for (const fabric::Value& value : sample.values) {
      table.add({base::text::safe(sample.key.to_string()), base::text::safe(sample.group),
                 period_text(sample), base::text::safe(value.name),
                 std::string(fabric::name_of(value.type)), print::text_of(value),
                 std::string(fabric::name_of(value.quality)), ago(value.at),
                 why(value.reason, sample.replayed)});
    }
  }
  fmt::print("{}", table.text());
}

int show_once(const Options& options) {
  Samples samples;
  listen(options, [&](const recording::Entry& entry) {
    if (const DataSample* sample = sample_for(options, entry)) {
      if (sample->values.empty()) {
        samples.erase({sample->key, sample->group});
      } else {
        samples.insert_or_assign({sample->key, sample->group}, entry);
      }
    }
    return true;
  });
  if (samples.empty() && !options.machine.empty()) {
    return report_unknown_machine(options);
  }
  if (options.json) {
    boost::json::array out;
    for (const auto& [key, entry] : samples) {
      out.push_back(print::json_of(entry));
    }
    print::print_json(out);
  } else if (samples.empty()) {
    fmt::print(
        "no gateway on fabric '{}', domain {}, publishes such data; data {{ }} in its "
        "configuration lists what it samples\n",
        options.fabric.options().fabric, options.fabric.options().domain);
  } else {
    show_table(samples);
  }
  return program::exit_done;
}

}  // namespace

void add_data(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "data", "Values of machines, as gateways sample them",
                     "millrace data press\n"
                     "  millrace data press --group axes --watch --json | jq .values[0].value");
  auto options = std::make_shared<Options>(command);
  command.callback([options, &chosen] {
    chosen.run = [options] {
      if (!options->watch) {
        return show_once(*options);
      }
      return follow(*options, [options](const recording::Entry& entry) {
        return sample_for(*options, entry) != nullptr;
      });
    };
  });
}

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

int report_unknown_machine(const DataOptions& options) {
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
