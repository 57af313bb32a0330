// Decides when a rule has an occasion for a mail, from the data of a fabric observer. Pure.
//
//   RuleWatch watch(config.rules, " --domain 7", now);
//   watch.on_entry(entry, now);
//   watch.on_time(now);                        // at watch.next_time()
//   for (const RuleEvent& occasion : watch.take()) …
//
// What is wrong is judged by fabric/plant; a rule selects concerns. One mail for each occasion: a
// cause that lasts is reported once, and again only after it has ended. Within the quiet time of a
// rule, another event of the same channel or cause is not reported; the next mail contains the
// number of such events. A cause that still lasts at the end of the quiet time is reported then.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fabric/moment.hpp"
#include "fabric/observer/entry.hpp"
#include "fabric/plant/plant.hpp"
#include "services/mail/config.hpp"

namespace millrace::services::mail {

struct RuleEvent {
  /// Index into the rules.
  std::size_t rule = 0;
  /// The same for the same occasion, independent of the observer and the time, so that its mail is
  /// sent once.
  fabric::CallId id{};
  Values values{};
};

class RuleWatch {
 public:
  /// Limit of the stored causes, and of the quiet times of all rules: their names come from the
  /// fabric.
  static constexpr std::size_t most_remembered = 10'000;
  /// An event that is older than this when it is first seen is ignored.
  static constexpr std::chrono::minutes history{10};
  /// Between two judgements of the plant.
  static constexpr std::chrono::seconds judge_period{1};
  /// Time to find the processes of the fabric before the first judgement.
  static constexpr std::chrono::seconds settle{5};

  /// `flags` are those of the fabric, for suggested commands. Ignores data from a recording.
  RuleWatch(std::vector<Rule> rules, std::string flags, fabric::Moment now);

  void on_entry(const fabric::observer::Entry& entry, fabric::Moment now);
  void on_time(fabric::Moment now);
  /// When on_time() is due next; nothing if all rules are about NC programs.
  [[nodiscard]] std::optional<fabric::SteadyTime> next_time() const { return judge_at_; }

  std::vector<RuleEvent> take() { return std::exchange(occasions_, {}); }
  /// Log lines about events without a mail.
  std::vector<std::string> take_lines() { return std::exchange(lines_, {}); }

 private:
  /// A rule, and its channel or the cause of its concern.
  using Place = std::pair<std::size_t, std::string>;

  /// A cause that lasts.
  struct Lasting {
    fabric::Time since{};
    bool reported = false;
    /// The last judgement has found it.
    bool found = true;
  };
  struct Quiet {
    fabric::SteadyTime until{};
    std::uint64_t unsaid = 0;
  };

  void on_event(const fabric::ProgramEvent& event, fabric::Moment now);
  void judge(fabric::Moment now);
  void find(std::size_t rule, const fabric::plant::Concern& concern, fabric::Moment now);
  void tell(const Place& place, const std::string& about, fabric::Time at, Values values,
            fabric::Moment now);
  [[nodiscard]] bool is_quiet(const Place& place, fabric::Moment now) const;
  bool has_room(std::size_t remembered);

  std::vector<Rule> rules_;
  std::string flags_;
  fabric::plant::Plant plant_;
  std::optional<fabric::SteadyTime> judge_at_;
  std::map<Place, Lasting> lasting_;
  std::map<Place, Quiet> quiet_;
  std::vector<RuleEvent> occasions_;
  std::vector<std::string> lines_;
  bool reported_full_ = false;
};

}  // namespace millrace::services::mail
