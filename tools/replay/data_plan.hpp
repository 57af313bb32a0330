// When recorded machine data and program events are sent again, and with which times. Pure.
//
//   DataPlan plan({.timing = Timing::timed, .rate = 2}, max_gap);
//   … plan.add(entry) for each entry …                 // first pass: learns all times
//   plan.due(entry)                                    // since the start of the replay
//   plan.replayed(sample, key, start)                  // for that channel, times moved, marked
//
// A recording may be larger than memory, so the entries themselves are read twice and not kept.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tools/recording/entry.hpp"
#include "tools/replay/scheduler.hpp"

namespace millrace::tools::replay {

class DataPlan {
 public:
  /// Gaps longer than `max_gap` are cut to it; zero = no cut. Timing::step is not for data.
  explicit DataPlan(Pace pace, nanoseconds max_gap = {}) : pace_(pace), max_gap_(max_gap) {}

  /// In the order of the file. Other entries than data and program events are ignored.
  void add(const recording::Entry& entry);

  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  [[nodiscard]] std::uint64_t events() const { return events_; }
  [[nodiscard]] const std::set<fabric::ChannelKey>& channels() const { return channels_; }

  /// When an entry that was received at `received` is sent, since the start of the replay.
  [[nodiscard]] nanoseconds due(fabric::Time received) const;
  /// A recorded time, moved to a replay that began at `start`. Distances between times are as in
  /// the replay; with Timing::fast as recorded, so that the last entry has the time of the start.
  /// Times far from the recording, such as an unknown time, stay.
  [[nodiscard]] fabric::Time moved(fabric::Time recorded, fabric::Time start) const;

  [[nodiscard]] fabric::DataSample replayed(fabric::DataSample sample, fabric::ChannelKey key,
                                            fabric::Time start) const;
  [[nodiscard]] fabric::ProgramEvent replayed(fabric::ProgramEvent event, fabric::ChannelKey key,
                                              fabric::Time start) const;

 private:
  /// All that is cut before `time`.
  [[nodiscard]] nanoseconds cut_before(fabric::Time time) const;

  Pace pace_;
  nanoseconds max_gap_;
  std::uint64_t samples_ = 0;
  std::uint64_t events_ = 0;
  std::set<fabric::ChannelKey> channels_;
  std::optional<fabric::Time> first_;
  fabric::Time last_{};
  /// The end of each cut, and the total of all cuts until then.
  std::vector<std::pair<fabric::Time, nanoseconds>> cuts_;
};

/// What a replay has published and must withdraw at its end.
class PublishedValues {
 public:
  void add(const fabric::DataSample& sample);
  void add(const fabric::ProgramEvent& event);

  /// Resets of the programs that still run: they do not continue after the replay.
  [[nodiscard]] std::vector<fabric::ProgramEvent> resets(fabric::Time now) const;
  /// One sample of each key.
  [[nodiscard]] std::vector<fabric::DataSample> groups() const;
  [[nodiscard]] std::vector<fabric::ProgramEvent> programs() const;

 private:
  std::set<std::pair<fabric::ChannelKey, std::string>> groups_;
  std::map<fabric::ChannelKey, fabric::ProgramEvent> programs_;
};

}  // namespace millrace::tools::replay
