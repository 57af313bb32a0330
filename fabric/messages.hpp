// The samples of a fabric as C++ values, each with the list of its fields. The C types that idlc
// generates stay in fabric/wire.
#pragma once

#include <array>
#include <chrono>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/messages/message.hpp"
#include "fabric/fields.hpp"

namespace millrace::fabric {

using base::messages::Message;

/// What a later version adds to a sample: kept, and shown by its name.
struct Extra {
  std::string name{};
  std::string bytes{};
  bool operator==(const Extra&) const = default;
};
MILLRACE_FIELDS(Extra, name, (bytes, .cp1252 = true))
using Extras = std::vector<Extra>;

/// Bytes of a CNC string in CP1252, at most 127 (idl/millrace.idl).
inline constexpr std::size_t max_text = 127;

/// Nanoseconds since 1970-01-01T00:00:00Z; zero = not known, never.
using Time = std::chrono::sys_time<std::chrono::nanoseconds>;

/// A channel of a machine: the key of every call.
struct ChannelKey {
  std::string machine{};
  std::uint16_t channel = 0;
  auto operator<=>(const ChannelKey&) const = default;
  /// "cnc/1"
  [[nodiscard]] std::string to_string() const;
};
MILLRACE_FIELDS(ChannelKey, (machine, .words = "machine name"), channel)

/// Gateway epoch and the number of the call in it; unique for ever.
struct CallId {
  std::uint64_t epoch = 0;
  std::uint64_t number = 0;
  auto operator<=>(const CallId&) const = default;
  /// "5f3a9c0112d4-17": epoch in hex, number in decimal.
  [[nodiscard]] std::string to_string() const;
};
MILLRACE_FIELDS(CallId, epoch, number)

/// Identity of one running instance of a service.
struct InstanceId {
  std::array<std::uint8_t, 16> bytes{};
  auto operator<=>(const InstanceId&) const = default;
  /// Canonical UUID form.
  [[nodiscard]] std::string to_string() const;
  /// The 36-character form, in any case.
  static std::optional<InstanceId> parse(std::string_view text);
  static InstanceId random();
};

struct Request {
  ChannelKey key{};
  CallId call{};
  /// 1, 2, …; 0: the request under this key is withdrawn.
  std::uint32_t attempt = 1;
  /// The one instance that may run this attempt.
  InstanceId assigned{};
  /// The epoch of the former gateway of the channel; its requests are over. 0 = none.
  std::uint64_t succeeds = 0;
  /// As the NC program wrote it.
  std::string uuid{};
  std::string text{};
  std::uint32_t state = 0;
  Time deadline{};
  Time seen{};
  Time dispatched{};
  /// An instance without room keeps it for later instead of declining it: no other one has room.
  bool may_wait = false;
  bool replayed = false;
  Extras extras{};
  /// The requester by DDS and its certificate (wire::requester_of); not on the wire. Set only in a
  /// request that an instance has taken.
  std::uint64_t requester = 0;
  bool operator==(const Request&) const = default;
};
MILLRACE_FIELDS(Request, (key, .required = true), call, (uuid, .words = "UUID", .sparse = true),
                attempt, assigned, (succeeds, .hex = true),
                (text, .cp1252 = true, .most = max_text), state, deadline, seen, dispatched,
                may_wait, replayed, (extras, .sparse = true),
                (requester, .on_wire = false, .observed = false))

/// Declined: the attempt was not begun and will not be.
enum class ReplyKind : std::uint8_t { interim, final, declined };
enum class ServiceCode : std::uint8_t { ok, failed, repeated, refused };

struct Reply {
  ChannelKey key{};
  InstanceId instance{};
  CallId call{};
  std::uint32_t attempt = 1;
  ReplyKind kind = ReplyKind::final;
  ServiceCode code = ServiceCode::ok;
  std::string text{};
  std::uint32_t state = 0;
  /// Text and state of the answered request.
  std::string asked_text{};
  std::uint32_t asked_state = 0;
  Time received{};
  Time started{};
  Time answered{};
  /// Of a declined one.
  Message reason{};
  bool replayed = false;
  Extras extras{};
  bool operator==(const Reply&) const = default;
};
MILLRACE_FIELDS(Reply, (key, .required = true), call, attempt, instance, (kind, .json = "reply"),
                code, (text, .cp1252 = true, .most = max_text), state,
                (asked_text, .observed = false), (asked_state, .observed = false), received,
                started, answered, (reason, .sparse = true), replayed, (extras, .sparse = true))

/// The final reply of the instance that got the request.
Reply reply_to(const Request& request, std::string text, std::uint32_t state);

enum class Delivery : std::uint8_t { at_least_once, at_most_once };

/// The variable that the NC programs of a service wait for: RESPONSE_STATE, as SysServiceWait and
/// the vendor's sample do, or a text in RESPONSE, as the manual describes
/// (IB/tf5200_service_interface/356533387, documented); then a response may have state 0.
enum class CompletionSignal : std::uint8_t { response_state, response };

/// A channel an instance serves: empty machine = any machine, channel 0 = any channel.
struct ChannelScope {
  std::string machine{};
  std::uint16_t channel = 0;
  auto operator<=>(const ChannelScope&) const = default;
};

/// What an instance announces in the user_data of its request reader; never what changes with a
/// call.
struct InstanceIdentity {
  InstanceId id{};
  /// Canonical form (see canonical_uuid).
  std::string uuid{};
  std::string name{};
  std::string description{};
  std::string version{};
  std::string host{};
  std::uint32_t pid = 0;
  /// Empty = every channel.
  std::vector<ChannelScope> channels{};
  Delivery delivery = Delivery::at_least_once;
  CompletionSignal completion_signal = CompletionSignal::response_state;
  std::uint32_t concurrency = 1;
  bool draining = false;
  /// Its process sends several heartbeats in this time: after a silence of this length it counts as
  /// gone. 0: it sends no heartbeats.
  std::chrono::milliseconds lease{};
  /// The same from a request until a while after its response; 0: as without calls.
  std::chrono::milliseconds busy_lease{};
  /// The name in the proved certificate of its process; empty without trust. Not announced by the
  /// instance.
  std::string certificate{};
  bool operator==(const InstanceIdentity&) const = default;
};
MILLRACE_FIELDS(InstanceIdentity, (id, .json = "instance", .proto = "instance"), uuid, name,
                description, version, host, pid, (channels, .proto = "channel"), delivery,
                (completion_signal, .proto = "awaits_response"), concurrency, draining, lease,
                busy_lease, (certificate, .sparse = true, .on_wire = false))

enum class ChannelState : std::uint8_t {
  link_down,
  idle,
  unserved,
  waiting,
  running,
  answering,
  held
};

struct ChannelStatus {
  ChannelKey key{};
  ChannelState state = ChannelState::link_down;
  Time since{};
  CallId call{};
  std::uint32_t attempt = 0;
  InstanceId instance{};
  std::string uuid{};
  /// Why it does not go on; empty if it does, or if its state says all.
  Message reason{};
  std::uint64_t calls = 0;
  std::uint64_t answered = 0;
  std::uint64_t withdrawn = 0;
  std::uint64_t repeated = 0;
  std::uint64_t late = 0;
  std::uint64_t failed = 0;
  /// An observer says that the gateway is gone; only key, since and reason have a value then.
  bool gone = false;
  Extras extras{};
  bool operator==(const ChannelStatus&) const = default;
};
MILLRACE_FIELDS(ChannelStatus, (key, .required = true), call,
                (uuid, .words = "UUID", .sparse = true), (state, .json = "channel_state"), since,
                attempt, instance, reason, calls, (answered, .json = "answered_calls"), withdrawn,
                (repeated, .proto = "repeated_calls"), late, failed,
                (gone, .sparse = true, .on_wire = false), (extras, .sparse = true))

/// No gateway claims before 2020 or after 2199: even a gateway with an unset clock claims within
/// these limits. A sample outside of them is a mistake or a lie, and would block the machine or
/// take it from any later gateway.
inline constexpr Time earliest_claim{std::chrono::sys_days{std::chrono::year{2020} / 1 / 1}};
inline constexpr Time latest_claim{std::chrono::sys_days{std::chrono::year{2200} / 1 / 1}};
constexpr bool is_plausible_claim(Time claimed) {
  return claimed >= earliest_claim && claimed <= latest_claim;
}

/// How a gateway learns of changes in the channels of a machine.
enum class WatchMode : std::uint8_t {
  /// It is not connected, or serves no channel.
  none,
  /// It reads them periodically.
  polled,
  /// Some channels send notifications, others are polled.
  partly_pushed,
  /// The controller sends ADS notifications; polling is only a safeguard.
  pushed
};

/// Whether a gateway that ends without a word has what it needs to continue its calls.
enum class JournalState : std::uint8_t {
  not_known,
  kept,
  /// By its configuration: after a crash calls that were under way may run twice or be lost.
  none,
  /// There is one, and it cannot be written: no new call is accepted.
  not_writable
};

/// The link between a gateway and one controller, and which of its channels the gateway claims.
struct MachineStatus {
  std::string machine{};
  /// Drawn when the gateway starts; two gateways may be configured for one machine.
  InstanceId gateway{};
  /// When it claimed them: the earlier of two claims counts.
  Time claimed{};
  /// At most 255; empty = all channels of the controller.
  std::vector<std::uint16_t> claims{};
  bool connected = false;
  WatchMode watch = WatchMode::none;
  Time since{};
  /// TCP address and AMS NetId, as the configuration has them; at most 127 bytes.
  std::string address{};
  /// For people: why it is not connected, which channels another gateway serves, why it is polled.
  Message reason{};
  std::uint16_t channels = 0;
  /// Time between two reads of an idle channel.
  std::chrono::nanoseconds poll{};
  /// ADS requests of the last second, and the mean time until their responses.
  std::uint32_t requests_per_second = 0;
  std::chrono::nanoseconds round_trip{};
  /// The gateway's host, process and version, and the epoch that its calls carry.
  std::string host{};
  std::uint32_t pid = 0;
  std::string version{};
  std::uint64_t epoch = 0;
  JournalState journal = JournalState::not_known;
  /// An observer says that the gateway is gone; only machine, gateway, since and reason have a
  /// value then.
  bool gone = false;
  Extras extras{};
  bool operator==(const MachineStatus&) const = default;
};
MILLRACE_FIELDS(MachineStatus, (machine, .words = "machine name"), connected, watch, since, address,
                reason, channels, poll, requests_per_second, round_trip,
                (host, .json = "gateway_host", .words = "host name"), (pid, .json = "gateway_pid"),
                (version, .json = "gateway_version"), gateway,
                (epoch, .json = "gateway_epoch", .hex = true), claimed, (claims, .most = 255),
                journal, (gone, .sparse = true, .on_wire = false), (extras, .sparse = true))

struct InstanceStatus {
  InstanceId instance{};
  /// Calls in a handler; waiting ones are not included.
  std::uint32_t running = 0;
  std::uint32_t waiting = 0;
  std::uint64_t answered = 0;
  std::uint64_t failed = 0;
  std::uint64_t repeated = 0;
  std::uint64_t cancelled = 0;
  std::uint64_t declined = 0;
  std::chrono::nanoseconds mean{};
  Time started{};
  Time last_call{};
  bool operator==(const InstanceStatus&) const = default;
};
MILLRACE_FIELDS(InstanceStatus, instance, (running, .on_wire = false), waiting,
                (answered, .json = "answered_calls"), failed, (repeated, .proto = "repeated_calls"),
                cancelled, declined, mean, started, last_call)

/// The load of one instance.
struct InstanceLoad {
  /// `running` and `waiting` are the numbers of its calls.
  InstanceStatus status{};
  /// Its calls from all gateways, at most 256: the running ones, then the waiting ones.
  std::vector<CallId> calls{};
  bool operator==(const InstanceLoad&) const = default;
};
MILLRACE_FIELDS(InstanceLoad, status, (calls, .most = 256))

/// A process with instances runs, and so does its loop.
struct Heartbeat {
  /// A random id of the process, drawn when it starts.
  InstanceId process{};
  Time at{};
  /// At most 64: of its instances those with calls, those whose numbers changed lately, and the
  /// others in turn.
  std::vector<InstanceLoad> loads{};
  Extras extras{};
  bool operator==(const Heartbeat&) const = default;
};
MILLRACE_FIELDS(Heartbeat, process, at, (loads, .most = 64), (extras, .sparse = true))

enum class EventKind : std::uint8_t {
  seen,
  unserved,
  dispatched,
  interim,
  replied,
  written,
  withdrawn,
  lost,
  late,
  refused,
  held
};

struct Event {
  ChannelKey key{};
  CallId call{};
  std::uint32_t attempt = 0;
  EventKind kind = EventKind::seen;
  Time at{};
  InstanceId instance{};
  std::string uuid{};
  std::string text{};
  std::uint32_t state = 0;
  Message detail{};
  bool replayed = false;
  Extras extras{};
  bool operator==(const Event&) const = default;
};
MILLRACE_FIELDS(Event, (key, .required = true), call, (uuid, .words = "UUID", .sparse = true),
                (kind, .json = "event"), attempt, at, instance,
                (text, .cp1252 = true, .most = max_text), state, detail, replayed,
                (extras, .sparse = true))

/// A UUID in canonical lower case without braces and surrounding blanks; an identifier that is not
/// a UUID is used unchanged, trimmed (design: "Addressing").
std::string canonical_uuid(std::string_view text);
/// True for the 36-character form of a UUID, in any case.
bool is_uuid(std::string_view text);

// The id of a call, read from text.

/// "5f3a9c0112d4-17", as CallId::to_string() writes it; nothing for another text.
std::optional<CallId> parse_call_id(std::string_view text);

/// Whether this version knows kind and code of the reply. One that it does not know answers no
/// call: a later version may mean anything with it.
inline bool is_known(const Reply& reply) {
  return reply.kind <= ReplyKind::declined && reply.code <= ServiceCode::refused;
}

}  // namespace millrace::fabric
