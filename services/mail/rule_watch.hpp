// Decides when a rule has an occasion for a mail, from the data of a fabric observer. Pure.
//
//   RuleWatch watch(config.rules, now);
//   watch.on_entry(entry, now);
//   watch.on_time(now);                        // at watch.next_time()
//   for (const RuleEvent& occasion : watch.take()) …
//
// One mail for each occasion: a lasting condition is reported once, and again only after it has
// ended. Within the quiet time of a rule, another event of the same channel is not reported; the
// next mail contains the number of such events. A condition that still lasts at the end of the
// quiet time is reported then.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fabric/moment.hpp"
#include "fabric/observer/entry.hpp"
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
  /// Limit of the stored conditions, of the connections and of the quiet times of all rules, each:
  /// their names come from the fabric.
  static constexpr std::size_t most_remembered = 10'000;
  /// An event that is older than this when it is first seen is ignored.
  static constexpr std::chrono::minutes history{10};

  /// Ignores data from a recording.
  RuleWatch(std::vector<Rule> rules, fabric::Moment now);

  void on_entry(const fabric::observer::Entry& entry, fabric::Moment now);
  void on_time(fabric::Moment now);
  /// When the next lasting condition is due.
  [[nodiscard]] std::optional<fabric::SteadyTime> next_time() const;

  std::vector<RuleEvent> take() { return std::exchange(occasions_, {}); }
  /// Log lines about events without a mail.
  std::vector<std::string> take_lines() { return std::exchange(lines_, {}); }

 private:
  /// A rule and its channel, machine or service.
  using Place = std::pair<std::size_t, std::string>;

  /// A lasting condition.
  struct LastingCondition {
    /// A different time is another occasion.
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
  std::map<Place, LastingCondition> lasting_;
  std::map<Place, Quiet> quiet_;
  /// Connections by machine and gateway.
  std::map<std::string, std::map<fabric::InstanceId, bool>> links_;
  /// Ready instances, by service.
  std::map<std::string, std::set<fabric::InstanceId>> instances_;
  std::vector<RuleEvent> occasions_;
  std::vector<std::string> lines_;
  bool reported_full_ = false;
};

}  // namespace millrace::services::mail
