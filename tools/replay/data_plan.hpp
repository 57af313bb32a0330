// When recorded machine data and program events are sent again, and what they say then. Pure.
//
//   DataPlan plan({.timing = Timing::timed, .rate = 2}, max_gap);
//   … plan.add(entry) for each entry …                 // first to know which there are
//   plan.due(entry)                                    // since the start of the replay
//   plan.replayed(sample, key, start)                  // in that channel, at these times, marked
//
// A recording may be larger than memory, so the entries themselves are read twice and not kept.
#pragma once

#include <chrono>
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
  /// A longer time without an entry is cut to `max_gap`; zero = none is. Timing::step is not for
  /// data.
  explicit DataPlan(Pace pace, nanoseconds max_gap = {}) : pace_(pace), max_gap_(max_gap) {}

  /// In the order of the file. What is neither data nor an event of a program is not counted.
  void add(const recording::Entry& entry);

  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  [[nodiscard]] std::uint64_t events() const { return events_; }
  [[nodiscard]] const std::set<fabric::ChannelKey>& channels() const { return channels_; }

  /// When an entry that was received then is sent, since the start of the replay.
  [[nodiscard]] nanoseconds due(fabric::Time received) const;
  /// A recorded time in a replay that started then: as far from the others as it is sent. With
  /// Timing::fast as far as recorded, so that the last entry is of the start. What is far from all
  /// of the recording, as a time that is not known, stays.
  [[nodiscard]] fabric::Time moved(fabric::Time recorded, fabric::Time start) const;

  [[nodiscard]] fabric::DataSample replayed(fabric::DataSample sample, fabric::ChannelKey key,
                                            fabric::Time start) const;
  [[nodiscard]] fabric::ProgramEvent replayed(fabric::ProgramEvent event, fabric::ChannelKey key,
                                              fabric::Time start) const;

 private:
  /// What is cut of the time before.
  [[nodiscard]] nanoseconds cut_before(fabric::Time time) const;

  Pace pace_;
  nanoseconds max_gap_;
  std::uint64_t samples_ = 0;
  std::uint64_t events_ = 0;
  std::set<fabric::ChannelKey> channels_;
  std::optional<fabric::Time> first_;
  fabric::Time last_{};
  /// Where a cut ends, and all that is cut until then.
  std::vector<std::pair<fabric::Time, nanoseconds>> cuts_;
};

/// What a replay has told and must take back at its end.
class Told {
 public:
  void add(const fabric::DataSample& sample);
  void add(const fabric::ProgramEvent& event);

  /// A program that was under way is taken away: it does not go on when the replay has ended.
  [[nodiscard]] std::vector<fabric::ProgramEvent> resets(fabric::Time now) const;
  /// One of each key.
  [[nodiscard]] std::vector<fabric::DataSample> groups() const;
  [[nodiscard]] std::vector<fabric::ProgramEvent> programs() const;

 private:
  std::set<std::pair<fabric::ChannelKey, std::string>> groups_;
  std::map<fabric::ChannelKey, fabric::ProgramEvent> programs_;
};

}  // namespace millrace::tools::replay
