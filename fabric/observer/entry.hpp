// One thing that happened on a fabric, as an observer sees it and a recording keeps it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "fabric/alarm.hpp"
#include "fabric/command.hpp"
#include "fabric/data.hpp"
#include "fabric/messages.hpp"

namespace millrace::fabric::observer {

/// The gateway took its request back: the call is answered, or the program has withdrawn it.
struct Withdrawal {
  ChannelKey key{};
  /// Of the request that stood there; zero if the observer had not seen it.
  CallId call{};
  /// From whom; zero in recordings of the first version of the wire, whose requests stood for all.
  InstanceId instance{};
  /// As of the request (Request::requester); not recorded.
  std::uint64_t requester = 0;
  bool operator==(const Withdrawal&) const = default;
};
MILLRACE_FIELDS(Withdrawal, key, call, instance, (requester, .observed = false))

enum class Change : std::uint8_t {
  ready,
  changed,
  /// DDS knows its process no longer.
  gone,
  /// DDS knows its process, which sends no heartbeats: it stands still, or was killed just now, or
  /// its host cannot be reached.
  silent
};
std::string_view name_of(Change change);
/// Gone or silent: it gets no calls.
constexpr bool is_absent(Change change) {
  return change == Change::gone || change == Change::silent;
}

/// An instance came, changed its identity, fell silent, or is gone (in the last two only its id is
/// certain). One that is silent becomes ready again, or is gone.
struct InstanceNews {
  Change change = Change::ready;
  InstanceIdentity identity{};
  bool operator==(const InstanceNews&) const = default;
};
MILLRACE_FIELDS(InstanceNews, change, identity)

/// An alarm of a process; or, `over`, its end, also by the end of the process: then the alarm is
/// the last sample, or only its key if no sample was received.
struct AlarmNews {
  bool over = false;
  Alarm alarm{};
  /// It is over because its process is gone without having taken it back.
  bool lost = false;
  bool operator==(const AlarmNews&) const = default;
};
MILLRACE_FIELDS(AlarmNews, over, alarm, lost)

using Sample =
    std::variant<Request, Reply, Withdrawal, ChannelStatus, InstanceNews, InstanceStatus, Event,
                 Command, Outcome, MachineStatus, DataSample, ProgramEvent, AlarmNews>;

struct Entry {
  /// When the observer received it.
  Time at{};
  /// The service it is about, in canonical form; empty if none, or not known.
  std::string uuid{};
  /// The bytes its text had, if the recording leaves the text out.
  std::optional<std::uint32_t> withheld{};
  Sample sample{};
  bool operator==(const Entry&) const = default;
};

/// "request", "reply", …: what an entry is, in one word.
std::string_view kind_of(const Entry& entry);
/// The machine it is about, or nullptr.
const std::string* machine_of(const Entry& entry);
/// The channel it is about, or nullptr.
const ChannelKey* channel_of(const Entry& entry);
/// The call it is about; zero if none.
CallId call_of(const Entry& entry);
/// When it happened by its own account; the time of recording where it gives none.
Time origin_of(const Entry& entry);
/// Its request or response text, or nullptr.
const std::string* text_of(const Entry& entry);
/// Replaces the text by its size.
void withhold_text(Entry& entry);
/// A reply or event that says that a call went wrong at a service or was given up.
bool is_failure(const Entry& entry);
bool is_failure(const Reply& reply);

}  // namespace millrace::fabric::observer
