// The programs of channels: what was told last of each, and the runs of the last time, put together
// from events. Pure.
//
//   store.add(event, received);                          // each, as it comes
//   store.last({.machine = "press"})                     // as `millrace programs --json`
//   store.runs({.machine = "press"}, 100)                // the newest first
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "fabric/data.hpp"

namespace millrace::tools::web::plant {

/// An empty text, and channel 0, take everything.
struct ProgramFilter {
  std::string machine{};
  std::uint16_t channel = 0;
};

class ProgramStore {
 public:
  struct Limits {
    /// Whoever is on the fabric can tell what he likes.
    std::size_t channels = 1'000;
    /// Of each, and of one run so many times that it was held.
    std::size_t runs = 200;
    std::size_t holds = 20;
  };

  ProgramStore() : ProgramStore(Limits{}) {}
  explicit ProgramStore(Limits limits) : limits_(limits) {}

  void add(const fabric::ProgramEvent& event, fabric::Time received);
  /// No gateway of the machine is heard: what becomes of the runs that are under way nobody knows.
  void silence(const std::string& machine);
  /// The gateway that told of them last is heard again. It tells of changes only, so what it told
  /// last still holds.
  void end_silence(const std::string& machine);
  /// Another gateway has the machine: an error that still stands it tells again.
  void begin_anew(const std::string& machine);

  /// What the channel's program is doing, as far as somebody should know of it.
  struct Condition {
    enum class Kind : std::uint8_t { runs, stands, aborted };
    Kind kind = Kind::runs;
    fabric::ProgramEvent event{};
  };
  /// Nothing where no program runs and none was aborted, or nobody knows.
  [[nodiscard]] std::optional<Condition> condition(const fabric::ChannelKey& key) const;

  /// The last event of each channel, with the fields of `millrace programs --json`.
  [[nodiscard]] boost::json::array last(const ProgramFilter& filter) const;
  /// {runs, more}: the newest first, at most `most`.
  [[nodiscard]] boost::json::object runs(const ProgramFilter& filter, std::size_t most) const;
  /// Adds the machines that programs are told of.
  void add_machines(std::set<std::string>& names) const;
  /// Channels of which a program was told.
  [[nodiscard]] std::size_t channels() const { return channels_.size(); }

 private:
  struct Hold {
    fabric::Time from{};
    std::optional<fabric::Time> to{};
  };
  struct Run {
    /// As told last.
    fabric::ProgramEvent event{};
    std::optional<fabric::Time> ended{};
    bool is_unknown = false;
    /// It was aborted, and somebody has cleared the error since.
    bool is_cleared = false;
    /// Its gateway is gone; the next one has not told of it yet.
    bool is_stale = false;
    std::deque<Hold> holds{};
  };
  struct Channel {
    fabric::ProgramEvent last{};
    fabric::Time received{};
    /// The oldest in front.
    std::deque<Run> runs{};
  };

  static bool is_about_an_aborted_run(Channel& channel, const fabric::ProgramEvent& event);
  Run& run_of(Channel& channel, const fabric::ProgramEvent& event) const;
  /// Of each channel of the machine that has a run.
  template <typename Change>
  void for_last_run(const std::string& machine, const Change& change);
  [[nodiscard]] static bool takes(const ProgramFilter& filter, const fabric::ChannelKey& key);
  [[nodiscard]] static boost::json::object json_of(const Run& run);

  Limits limits_;
  std::map<fabric::ChannelKey, Channel> channels_;
};

}  // namespace millrace::tools::web::plant
