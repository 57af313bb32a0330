// The published status of the link to one machine: kept up to date, and published when it changes.
// Pure.
//
//   MachineStatusWriter writer(status);          // what never changes: names, address, poll period
//   writer.on_up(2, now);
//   writer.on_load(load, now.steady);      // about once a second
//   if (auto news = writer.take_change()) publish(*news);
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "fabric/messages.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::machines {

/// The load of a link since it exists.
struct LinkLoad {
  std::uint64_t requests = 0;
  std::uint64_t answered = 0;
  /// The time until the answers, all in all.
  std::chrono::nanoseconds waited{};
};

class MachineStatusWriter {
 public:
  explicit MachineStatusWriter(fabric::MachineStatus status) : status_(std::move(status)) {}

  /// `note` is what is missing nevertheless: channels that others serve.
  void on_up(std::size_t channels, fabric::WatchMode watch, const fabric::Message& note,
             Moment now);
  /// Also when the link does not come up, or is not wanted; `reason` may change.
  /// `silent_for` is the time since the last response, if the link is lost because of that: the
  /// machine is down since then.
  void on_down(const fabric::Message& reason, Moment now, std::chrono::nanoseconds silent_for = {});
  /// Counters that fall belong to a new link.
  void on_load(const LinkLoad& load, SteadyTime now);
  void claim(fabric::Time since, std::vector<std::uint16_t> channels);
  void set_poll(std::chrono::nanoseconds poll) { status_.poll = poll; }
  void set_journal(fabric::JournalState journal) { status_.journal = journal; }
  void set_address(const std::string& address) { status_.address = address; }

  [[nodiscard]] const fabric::MachineStatus& status() const { return status_; }
  /// The status, if it is not what was published last.
  std::optional<fabric::MachineStatus> take_change();
  /// Its readers may have dropped it: publish it again.
  void republish() { published_.reset(); }

 private:
  fabric::MachineStatus status_;
  std::optional<fabric::MachineStatus> published_;
  LinkLoad load_;
  std::optional<SteadyTime> load_at_;
};

}  // namespace millrace::gateway::machines
