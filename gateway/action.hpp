// What the pure parts want done. Whoever drives them carries it out and reports back.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "fabric/messages.hpp"
#include "gateway/interest.hpp"
#include "gateway/journal_entry.hpp"
#include "gateway/moment.hpp"
#include "gateway/snapshot.hpp"

namespace millrace::gateway {

/// Read these variables; answered by on_read or on_read_failed. A session has at most one Read or
/// Write under way, and each gets exactly one answer, also when the link ends.
struct Read {
  ReadSet look = ReadSet::state;
  bool operator==(const Read&) const = default;
};

/// Write one variable; answered by on_write.
struct Write {
  Variable variable = Variable::request_state;
  Value value;
  /// The last write of a final answer, which releases the program.
  bool releases = false;
  bool operator==(const Write&) const = default;
};

/// Journal this and answer with on_recorded(ticket), if anybody waits, once it is as safe as the
/// journal's policy promises.
struct Record {
  Ticket ticket;
  JournalEntry entry;
  bool operator==(const Record&) const = default;
};

/// Give the call out on the fabric.
struct Publish {
  fabric::Request request;
};

/// Take the call back from an instance: it learns that nobody waits for its answer any more.
struct Withdraw {
  fabric::InstanceId instance;
  /// Of the call: what another gateway asks of the channel stays.
  std::uint64_t epoch = 0;
  bool operator==(const Withdraw&) const = default;
};

/// Something has happened to a call, while somebody listens.
struct Tell {
  fabric::Event event;
};

/// The channel's status, each time it changes while somebody looks.
struct Show {
  fabric::ChannelStatus status;
};

/// The channel is not ours any more: take its status back. The session is over.
struct Hide {
  bool operator==(const Hide&) const = default;
};

/// A line for the log; the channel's name goes before it.
struct Say {
  Level level = Level::info;
  std::string text;
  bool operator==(const Say&) const = default;
};

/// The write that the controller acknowledged and does not show; empty once there is none. Each
/// time it changes.
struct WriteProblem {
  std::string text;
  bool operator==(const WriteProblem&) const = default;
};

/// What leaves the core: gateway/live carries it out.
using Action =
    std::variant<Read, Write, Record, Publish, Withdraw, Tell, Show, Hide, Say, WriteProblem>;

/// A request is there: answer with claim() or leave() before anything else.
struct Offer {
  PendingRequest request;
  /// It was left before, and its policy's patience with unserved requests is over.
  bool out_of_patience = false;
  bool operator==(const Offer&) const = default;
};

/// The instance that had the call has answered it: nobody needs to be told, and the core takes the
/// request back when the channel is quiet.
struct LeaveBe {
  fabric::InstanceId instance;
  bool operator==(const LeaveBe&) const = default;
};

/// A call of an earlier run still waits for its answer: the dispatcher takes it up again.
struct Resume {
  fabric::CallId call;
  bool operator==(const Resume&) const = default;
};

/// The instance has answered, or the call is over: it is free for the next one.
struct Freed {
  fabric::CallId call;
  /// The answer stands in the channel.
  bool written = false;
  bool operator==(const Freed&) const = default;
};

/// The instance has not begun this attempt and will not: the call goes to another one.
struct Declined {
  fabric::CallId call;
  bool operator==(const Declined&) const = default;
};

/// Call on_wake at this time or before; replaces what was asked before.
struct WakeAt {
  SteadyTime at;
  bool operator==(const WakeAt&) const = default;
};

/// What a session wants: of the world, or of the core, which keeps the last six to itself.
using SessionAction = std::variant<Action, Offer, LeaveBe, Resume, Freed, Declined, WakeAt>;
using SessionActions = std::vector<SessionAction>;

/// Room for the actions of most steps, in a piece of memory that is small enough to be had cheaply:
/// above 1 KiB the allocator of the GNU C library tidies up first.
inline constexpr std::size_t few_actions = 4;

/// How a write ended.
enum class WriteOutcome : std::uint8_t {
  written,
  /// The controller said no, or nothing was sent.
  refused,
  /// Timeout, link lost: perhaps it was written, perhaps not.
  unknown,
};

}  // namespace millrace::gateway
