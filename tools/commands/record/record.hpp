// `millrace record`: records a whole fabric into a file.
#pragma once

#include <chrono>
#include <set>
#include <string>

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <tl/expected.hpp>

#include "base/loop/loop.hpp"
#include "fabric/endpoints/alarm_endpoint.hpp"
#include "fabric/observer/observer.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/recorder/alarms.hpp"
#include "tools/recorder/recorder.hpp"

namespace millrace::tools::commands::record {

void add_record(CLI::App& app, Chosen& chosen);

// A running recording: from the fabric into the file, until a signal.
//
//   RecordRun run(participant, options);
//   run.start();
//   const auto result = run.run();

/// Joins observer, recorder, timer and signals in one io_context.
class RecordRun : public fabric::observer::ObserverListener {
 public:
  /// `flags` are those of the fabric, for suggested commands.
  RecordRun(fabric::dds::Participant& participant, recorder::Options options, std::string flags);

  /// Begins the file; the error is the reason of a failure.
  recorder::Recorder::Result start() { return recorder_.start(Clock::now()); }

  /// Records until a signal, a full disk or an error; the latter is the result.
  recorder::Recorder::Result run();

  void on_entry(recording::Entry entry) override;
  void on_ignored(const std::string& reason) override;

  [[nodiscard]] const recorder::Recorder& recorder() const { return recorder_; }
  /// The samples of other processes.
  [[nodiscard]] fabric::observer::Counts counts() const;

 private:
  using Clock = std::chrono::steady_clock;

  /// Entries before the signal belong to the recording; but a flood of entries must not keep it
  /// from ending.
  void take_rest();

  void schedule_tick();
  void end_with(const fabric::Message& reason);
  void warn_if_silent();
  void report_waiting();

  /// Publishes its condition once a second.
  void report_condition();
  void note(const tl::expected<void, std::string>& published);
  void keep(const recorder::Recorder::Result& result);

  static constexpr std::chrono::seconds discovery_time{10};

  const fabric::InstanceId responder_ = fabric::InstanceId::random();
  const std::string flags_;
  std::uint64_t own_ = 0;
  /// The constant parts of it; the rest is as last published.
  recorder::Condition condition_;
  recorder::Recorder recorder_;
  recorder::Recorder::Result result_;
  Clock::time_point begun_ = Clock::now();
  bool warned_of_silence_ = false;
  bool waited_ = false;
  Clock::time_point next_word_{};
  /// The kinds of the published alarms.
  std::set<std::string> raised_;
  bool reported_unpublished_ = false;
  boost::asio::io_context io_{1};
  const base::loop::Watchdog watchdog_{io_.get_executor()};
  boost::asio::steady_timer timer_;
  boost::asio::signal_set signals_;
  fabric::observer::Observer observer_;
  fabric::endpoints::AlarmEndpoint alarms_;
};

}  // namespace millrace::tools::commands::record
