// When a rule has an occasion for a mail, from what an observer of the fabric sees. Pure.
//
//   RuleWatch watch(config.rules, now);
//   watch.on_entry(entry, now);
//   watch.on_time(now);                        // at watch.next_time()
//   for (const Occasion& occasion : watch.take()) …
//
// One mail for each occasion: what lasts is told once, and again only when it was over in between.
// Within the quiet time of a rule another event of the same channel is not told; how many were not,
// the next mail says. What lasts when the quiet time is over is told then.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fabric/moment.hpp"
#include "fabric/observer/entry.hpp"
#include "services/mail/rule.hpp"

namespace millrace::services::mail {

struct Occasion {
  /// Of the rules that were given.
  std::size_t rule = 0;
  /// The same for the same occasion, whoever sees it and when: its mail is sent once.
  fabric::CallId id{};
  Values values{};
};

class RuleWatch {
 public:
  /// Waits, links and quiet times of all rules that are remembered at most, of each so many: their
  /// names come from the fabric.
  static constexpr std::size_t most_remembered = 10'000;
  /// An event that is older when it is first seen is history.
  static constexpr std::chrono::minutes history{10};

  /// `replayed`: also what comes from a recording.
  RuleWatch(std::vector<Rule> rules, fabric::Moment now, bool replayed = false);

  void on_entry(const fabric::observer::Entry& entry, fabric::Moment now);
  void on_time(fabric::Moment now);
  /// When something that lasts is to be told.
  [[nodiscard]] std::optional<fabric::SteadyTime> next_time() const;

  std::vector<Occasion> take() { return std::exchange(occasions_, {}); }
  /// What is not told, for the log.
  std::vector<std::string> take_lines() { return std::exchange(lines_, {}); }

 private:
  /// A rule and what it is about.
  using Place = std::pair<std::size_t, std::string>;

  /// Something that lasts.
  struct Lasting {
    /// What makes it another occasion.
    fabric::Time since{};
    fabric::SteadyTime due{};
    Values values;
    bool told = false;
  };
  struct Quiet {
    fabric::SteadyTime until{};
    std::uint64_t unsaid = 0;
  };

  void on_event(const fabric::ProgramEvent& event, fabric::Moment now);
  void on_channel(const fabric::ChannelStatus& status, fabric::Moment now);
  void on_machine(const fabric::MachineStatus& status, fabric::Moment now);
  void on_instance(const fabric::observer::InstanceNews& news, fabric::Moment now);
  void begin(const Place& place, fabric::Time since, Values values, fabric::Moment now);
  void end(const Place& place) { lasting_.erase(place); }
  void tell(const Place& place, fabric::Time at, Values values, fabric::Moment now);
  [[nodiscard]] bool is_for(const Rule& rule, const std::string& machine) const;
  bool has_room(std::size_t remembered);

  std::vector<Rule> rules_;
  bool replayed_;
  std::map<Place, Lasting> lasting_;
  std::map<Place, Quiet> quiet_;
  /// Links by machine and gateway.
  std::map<std::string, std::map<fabric::InstanceId, bool>> links_;
  /// Those that are ready, by service.
  std::map<std::string, std::set<fabric::InstanceId>> instances_;
  std::vector<Occasion> occasions_;
  std::vector<std::string> lines_;
  bool said_full_ = false;
};

}  // namespace millrace::services::mail
