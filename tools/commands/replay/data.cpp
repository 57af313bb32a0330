// millrace replay --data: recorded machine data and events of NC programs again.
#include <algorithm>
#include <csignal>
#include <cstdio>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/json/object.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/endpoints/data_endpoint.hpp"
#include "tools/commands/recordings/recordings.hpp"
#include "tools/commands/replay/replay.hpp"
#include "tools/commands/replay/report.hpp"
#include "tools/print/json.hpp"
#include "tools/print/units.hpp"
#include "tools/recording/reader.hpp"
#include "tools/recording/statistics.hpp"
#include "tools/replay/data_plan.hpp"

namespace millrace::tools::commands::replay {

namespace {

namespace program = base::program;
using tools::replay::DataPlan;
using tools::replay::Timing;
using Clock = std::chrono::steady_clock;
using Channels = std::map<fabric::ChannelKey, fabric::ChannelKey>;

/// For readers to discover the new writers, and at the end to take the last samples.
constexpr auto time_to_be_found = std::chrono::milliseconds(300);
/// With --fast: a writer keeps this number of samples of a group for slow readers
/// (fabric/wire/topics.cpp), and half of them are sent at a time.
constexpr std::uint64_t samples_at_once = 16;
constexpr auto pause_between = std::chrono::milliseconds(5);

/// Ends the reading of the file.
struct Interrupted {};

class DataReplay {
 public:
  DataReplay(const Options& options, mcap::Source& source, const recording::Filter& filter,
             const DataPlan& plan, const Channels& channels)
      : options_(options),
        source_(source),
        filter_(filter),
        plan_(plan),
        channels_(channels),
        signals_(io_, SIGINT, SIGTERM),
        participant_(options.fabric.options()),
        end_(participant_),
        progress_(options.rounds * (plan.samples() + plan.events()), "samples") {
    signals_.async_wait([this](const boost::system::error_code& error, int) {
      if (!error) {
        interrupted_ = true;
        io_.stop();
      }
    });
  }

  int run() {
    wait_for(time_to_be_found);
    recording::ReadReport read;
    const auto begun = Clock::now();
    for (std::size_t round = 0; !interrupted_ && (options_.rounds == 0 || round < options_.rounds);
         ++round) {
      read = play();
    }
    const auto took = Clock::now() - begun;
    take_back();
    progress_.clear();
    report(took);
    return std::max(interrupted_ || refused_ > 0 ? program::exit_failed : program::exit_done,
                    recordings::report(options_.file, read.problems, read.has_read));
  }

 private:
  recording::ReadReport play() {
    start_ = Clock::now();
    wall_ = std::chrono::system_clock::now();
    try {
      return recording::read_entries(source_, filter_,
                                     [this](const recording::Entry& entry) { send(entry); });
    } catch (const Interrupted&) {
      return {};
    }
  }

  void send(const recording::Entry& entry) {
    const auto due = start_ + plan_.due(entry.at);
    if (options_.pace().timing == Timing::fast) {
      if (sent_ % samples_at_once == samples_at_once - 1) {
        wait_for(pause_between);
      }
    } else if (Clock::now() < due) {
      wait_until(due);
    }
    if (interrupted_) {
      throw Interrupted();
    }
    // A file that is still written may have another channel by now.
    const auto key = channels_.find(*recording::channel_of(entry));
    if (key == channels_.end()) {
      return;
    }
    late_.add(std::max(std::chrono::nanoseconds{}, std::chrono::nanoseconds(Clock::now() - due)));
    if (const auto* sample = std::get_if<fabric::DataSample>(&entry.sample)) {
      publish(plan_.replayed(*sample, key->second, wall_));
    } else if (const auto* event = std::get_if<fabric::ProgramEvent>(&entry.sample)) {
      publish(plan_.replayed(*event, key->second, wall_));
    }
    progress_.show(++sent_);
  }

  void publish(const fabric::DataSample& sample) {
    published_.add(sample);
    if (sample.values.empty()) {
      end_.unregister(sample);
    } else {
      check(end_.publish(sample));
    }
  }
  void publish(const fabric::ProgramEvent& event) {
    published_.add(event);
    check(end_.publish(event));
  }

  /// A file may contain anything: a value that is too long for the fabric loses its sample.
  void check(const tl::expected<void, std::string>& published) {
    if (!published && refused_++ == 0) {
      progress_.clear();
      fmt::print(stderr, "millrace: a sample is omitted: {}\n",
                 base::text::safe(published.error()));
    }
  }

  void take_back() {
    for (const fabric::ProgramEvent& reset : published_.resets(std::chrono::system_clock::now())) {
      check(end_.publish(reset));
    }
    io_.restart();
    io_.run_for(time_to_be_found);
    for (const fabric::DataSample& group : published_.groups()) {
      end_.unregister(group);
    }
    for (const fabric::ProgramEvent& event : published_.programs()) {
      end_.unregister(event);
    }
  }

  void wait_for(std::chrono::nanoseconds time) { wait_until(Clock::now() + time); }
  void wait_until(Clock::time_point time) {
    if (!interrupted_) {
      io_.restart();
      io_.run_until(time);
    }
  }

  void report(std::chrono::nanoseconds took) const {
    const bool timed = options_.pace().timing == Timing::timed;
    const auto ms = [](std::chrono::nanoseconds time) {
      return std::chrono::duration<double, std::milli>(time).count();
    };
    if (options_.json) {
      boost::json::object summary{{"samples", sent_},
                                  {"channels", channels_.size()},
                                  {"refused", refused_},
                                  {"interrupted", interrupted_},
                                  {"seconds", std::chrono::duration<double>(took).count()}};
      if (timed) {
        summary["late_ms"] = {{"p50", ms(late_.percentile(0.5))},
                              {"p99", ms(late_.percentile(0.99))},
                              {"max", ms(late_.max())}};
      }
      print::print_json(boost::json::object{{"summary", std::move(summary)}});
      return;
    }
    fmt::print("{} samples and events in {}\n", sent_, print::duration_text(took));
    if (timed && sent_ > 0) {
      fmt::print("sent after their time: p50 {}, p99 {}, at most {}\n",
                 print::duration_text(late_.percentile(0.5)),
                 print::duration_text(late_.percentile(0.99)), print::duration_text(late_.max()));
    }
    std::fflush(stdout);
    if (refused_ > 0) {
      fmt::print(stderr, "millrace: {} samples were omitted\n", refused_);
    }
    if (interrupted_) {
      fmt::print(stderr, "millrace: interrupted\n");
    }
  }

  const Options& options_;
  mcap::Source& source_;
  const recording::Filter& filter_;
  const DataPlan& plan_;
  const Channels& channels_;
  boost::asio::io_context io_{1};
  boost::asio::signal_set signals_;
  fabric::dds::Participant participant_;
  fabric::endpoints::DataEndpoint end_;
  Progress progress_;
  tools::replay::PublishedValues published_;
  recording::Histogram late_;
  Clock::time_point start_{};
  fabric::Time wall_{};
  std::uint64_t sent_ = 0;
  std::uint64_t refused_ = 0;
  bool interrupted_ = false;
};

}  // namespace

int data(const Options& options) {
  mcap::FileSource source = recordings::open(options.file);
  recording::Filter filter = options.filter;
  filter.kinds = {"data", "program"};
  DataPlan plan(options.pace(), options.max_gap);
  const auto read = recording::read_entries(
      source, filter, [&](const recording::Entry& entry) { plan.add(entry); });
  if (plan.channels().empty()) {
    recordings::report(options.file, read.problems, read.has_read);
    throw program::UsageError(
        fmt::format("{} has no machine data and no event of an NC program that passes the filters; "
                    "'millrace recording info' lists what it has",
                    options.file.string()));
  }
  const caller::Slot slot("replay", options.fabric.options());
  const Channels channels = channels_asked(options, slot, plan.channels());
  check_free(options, channels);
  for (const auto& [recorded, key] : channels) {
    fmt::print(stderr, "millrace: {} is replayed as {}\n", base::text::safe(recorded.to_string()),
               base::text::safe(key.to_string()));
  }
  return DataReplay(options, source, filter, plan, channels).run();
}

}  // namespace millrace::tools::commands::replay
