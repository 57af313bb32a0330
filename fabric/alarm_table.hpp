// What one program has to say of itself now, and what of it must be told. Pure.
//
//   AlarmTable table({.key = {.responder = id}, .program = "archiver", .host = "vm", .pid = 17});
//   table.raise({.key = {.kind = "archive"}, .text = "…"}, now);
//   const auto changes = table.changes();        // to write, to take back
#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "fabric/alarm.hpp"

namespace millrace::fabric {

class AlarmTable {
 public:
  /// Alarms that a program tells at the same time. Where it has more, the last one says how many.
  static constexpr std::size_t most = 32;

  /// `who` has the responder and the program's name, host and process, for all of them.
  explicit AlarmTable(Alarm who) : who_(std::move(who)) {}

  /// From now on, or still. What was raised before keeps its `since`, whatever it says now.
  void raise(const Alarm& alarm, Time now);
  /// Not any more. Nothing happens if it was not raised.
  void clear(const std::string& kind, const std::string& subject = {});

  struct Changes {
    std::vector<Alarm> to_publish{};
    std::vector<Alarm> to_dispose{};
  };
  /// What is new since the last time.
  Changes changes();

  [[nodiscard]] bool empty() const { return all_.empty(); }
  /// What is told.
  using Told = std::map<AlarmKey, Alarm>;
  [[nodiscard]] const Told& told() const { return told_; }

 private:
  [[nodiscard]] Told wanted() const;

  Alarm who_;
  std::map<AlarmKey, Alarm> all_;
  Told told_;
};

}  // namespace millrace::fabric
