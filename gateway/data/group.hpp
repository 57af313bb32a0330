// One data group: its known and published values, and the time of its next cycle. Pure.
//
//   Group group(settings, "press");
//   group.start(now);                         // the controller answers: due at once
//   group.begin_cycle();  …  group.at(i).value = …  …
//   if (auto sample = group.end_cycle(now)) publish(*sample);
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cnc/variables/reading.hpp"
#include "fabric/data.hpp"
#include "gateway/data/groups.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::data {

/// A variable or object of a group.
struct Item {
  fabric::Value value{};
  /// How it is read; nullopt until it is resolved.
  std::optional<cnc::variables::Reading> reading{};
  /// When it is resolved, while it is not known.
  SteadyTime resolve_at{};
  /// What was logged about it last.
  std::string logged{};
};

class Group {
 public:
  Group(GroupSettings settings, std::string machine);

  [[nodiscard]] const GroupSettings& settings() const { return settings_; }
  [[nodiscard]] std::vector<Item>& items() { return items_; }
  [[nodiscard]] Item& at(std::size_t item) { return items_.at(item); }

  /// The channel is served and its controller answers.
  void start(SteadyTime now);
  /// It is not, or not any more: good values become stale. Returns a sample if it differs from the
  /// published one.
  std::optional<fabric::DataSample> stop(const std::string& reason, Moment now);
  [[nodiscard]] bool started() const { return started_; }
  /// Its readers may have dropped it: publish everything again.
  void republish() { published_.clear(); }

  [[nodiscard]] SteadyTime due() const { return due_; }
  [[nodiscard]] bool in_cycle() const { return in_cycle_; }
  /// All known variables must be read.
  void begin_cycle();
  /// Of this cycle, and not requested yet.
  [[nodiscard]] std::set<std::size_t>& pending() { return pending_; }
  void asked(std::size_t item);
  void answered() { --under_way_; }
  /// Nothing is missing any more.
  [[nodiscard]] bool complete() const { return in_cycle_ && pending_.empty() && under_way_ == 0; }
  /// A sample if it is new, or all are wanted. The next cycle is at the next whole period.
  std::optional<fabric::DataSample> end_cycle(Moment now);

  /// The recent length of a cycle; the configured period while that is kept.
  [[nodiscard]] std::chrono::nanoseconds period() const { return period_; }
  [[nodiscard]] bool slow() const { return period_ > settings_.period; }
  /// True once after it became slow, or no longer is.
  bool take_period_change();

  /// The group as it is now, as a sample.
  [[nodiscard]] fabric::DataSample sample(Moment now) const;

 private:
  void measure(SteadyTime now);

  GroupSettings settings_;
  std::string machine_;
  std::vector<Item> items_;
  bool started_ = false;
  SteadyTime due_{};
  bool in_cycle_ = false;
  std::set<std::size_t> pending_;
  std::size_t under_way_ = 0;
  /// The last published values; empty = none yet.
  std::vector<fabric::Value> published_;
  std::chrono::nanoseconds period_;
  bool period_changed_ = false;
  /// Samples since then, to know how long one takes.
  SteadyTime counting_since_{};
  std::uint32_t counted_ = 0;
};

}  // namespace millrace::gateway::data
