// The alarms of one process, and which of them must be published or retracted. Pure.
//
//   AlarmTable table({.key = {.responder = id}, .program = "archiver", .host = "vm", .pid = 17});
//   table.raise({.key = {.kind = "archive"}, .text = "…"}, now);
//   const auto changes = table.changes();        // to publish, to retract
#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "fabric/alarm.hpp"

namespace millrace::fabric {

class AlarmTable {
 public:
  /// Alarms that a process publishes at the same time. The last one counts those beyond it.
  static constexpr std::size_t most = 32;

  /// `who` has the responder and the program's name, host and process, for all alarms.
  explicit AlarmTable(Alarm who) : who_(std::move(who)) {}

  /// Raises the alarm, or repeats it. A repeated one keeps its `since`, also with another text.
  void raise(const Alarm& alarm, Time now);
  /// Clears the alarm. Without effect if it was not raised.
  void clear(const std::string& kind, const std::string& subject = {});

  struct Changes {
    std::vector<Alarm> to_publish{};
    std::vector<Alarm> to_dispose{};
  };
  /// The changes since the last call.
  Changes changes();

  [[nodiscard]] bool empty() const { return all_.empty(); }
  /// The published alarms.
  using Published = std::map<AlarmKey, Alarm>;
  [[nodiscard]] const Published& published() const { return published_; }

 private:
  [[nodiscard]] Published wanted() const;

  Alarm who_;
  std::map<AlarmKey, Alarm> all_;
  Published published_;
};

}  // namespace millrace::fabric
