// NC programs of channels: the last event of each, and the runs of the last time, assembled from
// events. Pure.
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

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "fabric/data.hpp"

namespace millrace::tools::web::plant {

/// An empty text and channel 0 match everything.
struct ProgramFilter {
  std::string machine{};
  std::uint16_t channel = 0;
};

class ProgramStore {
 public:
  struct Limits {
    /// Any participant can publish anything, so everything is limited.
    std::size_t channels = 1'000;
    /// Runs of each channel, and holds of each run.
    std::size_t runs = 200;
    std::size_t holds = 20;
  };

  ProgramStore() : ProgramStore(Limits{}) {}
  explicit ProgramStore(Limits limits) : limits_(limits) {}

  void add(const fabric::ProgramEvent& event, fabric::Time received);
  /// The machine has no gateway: the fate of its open runs is unknown.
  void silence(const std::string& machine);
  /// The former gateway is back. It publishes changes only, so its last event still holds.
  void end_silence(const std::string& machine);

  /// The last event of each channel, with the fields of `millrace programs --json`.
  [[nodiscard]] boost::json::array last(const ProgramFilter& filter) const;
  /// {runs, more}: the newest first, at most `most`.
  [[nodiscard]] boost::json::object runs(const ProgramFilter& filter, std::size_t most) const;
  /// Adds the machines with program events.
  void add_machines(std::set<std::string>& names) const;
  /// Number of channels with program events.
  [[nodiscard]] std::size_t channels() const { return channels_.size(); }

 private:
  struct Hold {
    fabric::Time from{};
    std::optional<fabric::Time> to{};
  };
  struct Run {
    /// The last event.
    fabric::ProgramEvent event{};
    std::optional<fabric::Time> ended{};
    bool is_unknown = false;
    /// Aborted, and the error has been cleared since.
    bool is_cleared = false;
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
  /// Applies `change` to each channel of the machine that has a run.
  template <typename Change>
  void for_last_run(const std::string& machine, const Change& change);
  [[nodiscard]] static bool takes(const ProgramFilter& filter, const fabric::ChannelKey& key);
  [[nodiscard]] static boost::json::object json_of(const Run& run);

  Limits limits_;
  std::map<fabric::ChannelKey, Channel> channels_;
};

}  // namespace millrace::tools::web::plant
