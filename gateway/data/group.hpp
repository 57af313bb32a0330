// One data group: its known and published values, and the time of its next cycle. Pure.
//
//   Group group(settings, "press");
//   group.start(now);                         // the controller answers: due at once
//   group.begin_cycle();  …  group.at(i).value = …  …
//   if (auto sample = group.end_cycle(now)) publish(*sample);
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/variables/value.hpp"
#include "fabric/data.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::data {

// The sampled data of a machine, from the configuration (idl/gateway.proto, Data).

/// Values that are read together, and published together.
struct GroupSettings {
  /// A unique name in its channel; at most 63 characters.
  std::string name;
  std::uint16_t channel = 1;
  /// Variables as programs write them, objects as cnc/variables/objects.hpp has them.
  std::vector<std::string> names;
  std::chrono::milliseconds period{1000};
  /// A number counts as changed when it differs by more than this from the last published one.
  double deadband = 0;
  /// Published on each cycle; otherwise when a value is another one.
  bool always = false;
  bool operator==(const GroupSettings&) const = default;
};

struct DataSettings {
  std::vector<GroupSettings> groups;
  /// The request budget of all groups of the machine; calls have their own.
  double requests_per_second = 50;
  bool operator==(const DataSettings&) const = default;
};

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

/// How long a cycle takes, over some of them.
class CycleTime {
 public:
  explicit CycleTime(std::chrono::milliseconds wanted) : wanted_(wanted), period_(wanted) {}

  void start(SteadyTime now);
  /// Until the next start it counts as kept.
  void stop();
  /// A cycle has ended.
  void count(SteadyTime now);

  /// The recent length of a cycle; the wanted one while that is kept.
  [[nodiscard]] std::chrono::nanoseconds period() const { return period_; }
  [[nodiscard]] bool slow() const { return period_ > wanted_; }
  /// It became slow, or no longer is, since the last take_change().
  [[nodiscard]] bool changed() const { return changed_; }
  bool take_change() { return std::exchange(changed_, false); }

 private:
  std::chrono::milliseconds wanted_;
  std::chrono::nanoseconds period_;
  bool changed_ = false;
  /// Cycles since then, to know how long one takes.
  SteadyTime counting_since_{};
  std::uint32_t counted_ = 0;
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
  std::optional<fabric::DataSample> stop(const fabric::Message& reason, Moment now);
  [[nodiscard]] bool started() const { return started_; }
  /// Its readers may have dropped it: publish everything again.
  void republish() { published_.clear(); }

  [[nodiscard]] SteadyTime due() const { return due_; }
  [[nodiscard]] bool in_cycle() const { return cycle_.has_value(); }
  /// All known variables must be read.
  void begin_cycle();
  /// Of this cycle, and not requested yet.
  [[nodiscard]] const std::set<std::size_t>& pending() const { return cycle_->pending; }
  void asked(std::size_t item);
  void answered() { --cycle_->under_way; }
  /// Nothing is missing any more.
  [[nodiscard]] bool complete() const {
    return cycle_ && cycle_->pending.empty() && cycle_->under_way == 0;
  }
  /// A sample if it is new, or all are wanted. The next cycle is at the next whole period.
  std::optional<fabric::DataSample> end_cycle(Moment now);

  [[nodiscard]] const CycleTime& cycle_time() const { return cycle_time_; }
  bool take_period_change() { return cycle_time_.take_change(); }

  /// The group as it is now, as a sample.
  [[nodiscard]] fabric::DataSample sample(Moment now) const;

 private:
  struct Cycle {
    /// Not requested yet.
    std::set<std::size_t> pending{};
    /// Requested, without an answer.
    std::size_t under_way = 0;
  };

  GroupSettings settings_;
  std::string machine_;
  std::vector<Item> items_;
  bool started_ = false;
  SteadyTime due_{};
  std::optional<Cycle> cycle_;
  /// The last published values; empty = none yet.
  std::vector<fabric::Value> published_;
  CycleTime cycle_time_;
};

// Conversion of a controller's bytes to values of the fabric, and detection of changes. Pure.

/// The type as the fabric names it.
fabric::ValueType type_of(const cnc::variables::Reading& reading);
/// The controller's response as elements; the error describes the mismatch.
tl::expected<fabric::Elements, std::string> elements_of(const cnc::variables::Reading& reading,
                                                        cnc::variables::BytesView answer);

/// Whether `now` differs from the published value `last`: another quality, reason or text, a number
/// that differs by more than `deadband`, other elements. Its time does not count.
bool is_news(const fabric::Value& last, const fabric::Value& now, double deadband);

}  // namespace millrace::gateway::data
