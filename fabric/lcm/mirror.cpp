#include "fabric/lcm/mirror.hpp"

#include <millrace/mirror_event_t.hpp>
#include <millrace/mirror_reply_t.hpp>
#include <millrace/mirror_request_t.hpp>
#include <millrace/mirror_withdrawal_t.hpp>

#include "base/text/cp1252.hpp"
#include "base/text/number.hpp"
#include "fabric/call_id_text.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/lcm/message.hpp"
#include "fabric/words.hpp"

namespace millrace::fabric::lcm {

namespace {

using observer::Entry;
using observer::Withdrawal;

constexpr std::string_view prefix = "MILLRACE_MIRROR.";
constexpr std::int32_t not_withheld = -1;
/// A string of LCM ends at its first NUL.
constexpr std::string_view null_symbol = "\xE2\x90\x80";

std::string replaced(std::string text, std::string_view what, std::string_view with) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += with.size()) {
    text.replace(at, what.size(), with);
  }
  return text;
}

std::string shown(const std::string& cp1252) {
  return replaced(base::text::to_utf8(cp1252), std::string_view("\0", 1), null_symbol);
}

std::int64_t count(Time time) {
  return time.time_since_epoch().count();
}

std::int32_t withheld_of(const Entry& entry) {
  return entry.withheld ? static_cast<std::int32_t>(*entry.withheld) : not_withheld;
}

template <typename Value>
Message message(std::string_view kind, const Value& value) {
  return {.channel = std::string(prefix) + std::string(kind), .bytes = encode(value)};
}

Message mirror(const Request& request, const Entry& entry) {
  mirror_request_t to;
  to.at = count(entry.at);
  to.machine = request.key.machine;
  to.channel = request.key.channel;
  to.call = request.call.to_string();
  to.attempt = static_cast<std::int32_t>(request.attempt);
  to.instance = request.assigned.to_string();
  to.succeeds = fmt::format("{:x}", request.succeeds);
  to.uuid = shown(request.uuid);
  to.text = shown(request.text);
  to.withheld = withheld_of(entry);
  to.state = request.state;
  to.deadline = count(request.deadline);
  to.seen = count(request.seen);
  to.dispatched = count(request.dispatched);
  to.may_wait = request.may_wait ? 1 : 0;
  to.replayed = request.replayed ? 1 : 0;
  return message("request", to);
}

Message mirror(const Reply& reply, const Entry& entry) {
  mirror_reply_t to;
  to.at = count(entry.at);
  to.machine = reply.key.machine;
  to.channel = reply.key.channel;
  to.call = reply.call.to_string();
  to.attempt = static_cast<std::int32_t>(reply.attempt);
  to.instance = reply.instance.to_string();
  to.uuid = shown(entry.uuid);
  to.kind = static_cast<std::int8_t>(reply.kind);
  to.code = static_cast<std::int8_t>(reply.code);
  to.text = shown(reply.text);
  to.withheld = withheld_of(entry);
  to.state = reply.state;
  to.received = count(reply.received);
  to.started = count(reply.started);
  to.answered = count(reply.answered);
  to.replayed = reply.replayed ? 1 : 0;
  return message("reply", to);
}

Message mirror(const Withdrawal& withdrawal, const Entry& entry) {
  mirror_withdrawal_t to;
  to.at = count(entry.at);
  to.machine = withdrawal.key.machine;
  to.channel = withdrawal.key.channel;
  to.call = withdrawal.call.to_string();
  to.instance = withdrawal.instance.to_string();
  to.uuid = shown(entry.uuid);
  return message("withdrawal", to);
}

Message mirror(const Event& event, const Entry& entry) {
  mirror_event_t to;
  to.at = count(entry.at);
  to.machine = event.key.machine;
  to.channel = event.key.channel;
  to.call = event.call.to_string();
  to.attempt = static_cast<std::int32_t>(event.attempt);
  to.kind = std::string(name_of(event.kind));
  to.happened = count(event.at);
  to.instance = event.instance.to_string();
  to.uuid = shown(event.uuid);
  to.text = shown(event.text);
  to.withheld = withheld_of(entry);
  to.state = event.state;
  to.detail = replaced(event.detail, std::string_view("\0", 1), null_symbol);
  to.replayed = event.replayed ? 1 : 0;
  return message("event", to);
}

using Mistake = tl::unexpected<std::string>;

Time time_of(std::int64_t nanoseconds) {
  return Time(std::chrono::nanoseconds(nanoseconds));
}

/// What a foreign message is taken for if something in it is impossible: thrown here, caught below.
struct Impossible {
  std::string what;
};

std::string cp1252_of(const std::string& utf8, const char* field) {
  // The order matters: a NUL is no character that CP1252 lacks.
  auto text = base::text::to_cp1252(replaced(utf8, null_symbol, std::string_view("\0", 1)));
  if (!text) {
    throw Impossible{fmt::format("its {}: {}", field, text.error())};
  }
  return *std::move(text);
}

template <typename From>
ChannelKey key_of(const From& from) {
  // A tool that calls is a machine as well, of a name that no configuration would take.
  if (from.channel < 0 || from.channel > 0xFFFF || from.machine.size() > longest_machine_name) {
    throw Impossible{"it names no channel of a machine"};
  }
  return {from.machine, static_cast<std::uint16_t>(from.channel)};
}

CallId call_id_of(const std::string& text) {
  const auto call = parse_call_id(text);
  if (!call) {
    throw Impossible{"it names no call"};
  }
  return *call;
}

InstanceId instance_of(const std::string& text) {
  const auto instance = InstanceId::parse(text);
  if (!instance) {
    throw Impossible{"it names no instance"};
  }
  return *instance;
}

std::uint32_t number_of(std::int64_t number, const char* field) {
  if (number < 0 || number > 0xFFFF'FFFF) {
    throw Impossible{fmt::format("its {} is {}", field, number)};
  }
  return static_cast<std::uint32_t>(number);
}

template <typename Enumerator>
Enumerator one_of(std::int8_t number, Enumerator last, const char* field) {
  if (number < 0 || number > static_cast<std::int8_t>(last)) {
    throw Impossible{fmt::format("its {} is {}", field, number)};
  }
  return static_cast<Enumerator>(number);
}

EventKind kind_of(const std::string& word) {
  for (auto kind = EventKind::seen;; kind = static_cast<EventKind>(static_cast<int>(kind) + 1)) {
    if (name_of(kind) == word) {
      return kind;
    }
    if (kind == EventKind::held) {
      throw Impossible{"its kind of event is not known"};
    }
  }
}

std::optional<std::uint32_t> withheld_of(std::int32_t size) {
  return size == not_withheld ? std::nullopt : std::optional(number_of(size, "size"));
}

Entry unmirror(const mirror_request_t& from) {
  const auto succeeds = base::text::parse_number<std::uint64_t>(from.succeeds, 16);
  if (!succeeds) {
    throw Impossible{"it succeeds no epoch"};
  }
  Request request{.key = key_of(from),
                  .call = call_id_of(from.call),
                  .attempt = number_of(from.attempt, "attempt"),
                  .assigned = instance_of(from.instance),
                  .succeeds = *succeeds,
                  .uuid = cp1252_of(from.uuid, "UUID"),
                  .text = cp1252_of(from.text, "text"),
                  .state = number_of(from.state, "state"),
                  .deadline = time_of(from.deadline),
                  .seen = time_of(from.seen),
                  .dispatched = time_of(from.dispatched),
                  .may_wait = from.may_wait != 0,
                  .replayed = from.replayed != 0};
  std::string uuid = canonical_uuid(request.uuid);
  return {.at = time_of(from.at),
          .uuid = std::move(uuid),
          .withheld = withheld_of(from.withheld),
          .sample = std::move(request)};
}

Entry unmirror(const mirror_reply_t& from) {
  return {.at = time_of(from.at),
          .uuid = cp1252_of(from.uuid, "UUID"),
          .withheld = withheld_of(from.withheld),
          .sample = Reply{.key = key_of(from),
                          .instance = instance_of(from.instance),
                          .call = call_id_of(from.call),
                          .attempt = number_of(from.attempt, "attempt"),
                          .kind = one_of(from.kind, ReplyKind::declined, "kind"),
                          .code = one_of(from.code, ServiceCode::refused, "code"),
                          .text = cp1252_of(from.text, "text"),
                          .state = number_of(from.state, "state"),
                          .received = time_of(from.received),
                          .started = time_of(from.started),
                          .answered = time_of(from.answered),
                          .replayed = from.replayed != 0}};
}

Entry unmirror(const mirror_withdrawal_t& from) {
  return {.at = time_of(from.at),
          .uuid = cp1252_of(from.uuid, "UUID"),
          .sample = Withdrawal{.key = key_of(from),
                               .call = call_id_of(from.call),
                               .instance = instance_of(from.instance)}};
}

Entry unmirror(const mirror_event_t& from) {
  Event event{.key = key_of(from),
              .call = call_id_of(from.call),
              .attempt = number_of(from.attempt, "attempt"),
              .kind = kind_of(from.kind),
              .at = time_of(from.happened),
              .instance = instance_of(from.instance),
              .uuid = cp1252_of(from.uuid, "UUID"),
              .text = cp1252_of(from.text, "text"),
              .state = number_of(from.state, "state"),
              .detail = replaced(from.detail, null_symbol, std::string_view("\0", 1)),
              .replayed = from.replayed != 0};
  std::string uuid = canonical_uuid(event.uuid);
  return {.at = time_of(from.at),
          .uuid = std::move(uuid),
          .withheld = withheld_of(from.withheld),
          .sample = std::move(event)};
}

template <typename Value>
tl::expected<Entry, std::string> read(std::string_view bytes) {
  return decode<Value>(bytes).and_then([](const Value& value) -> tl::expected<Entry, std::string> {
    try {
      return unmirror(value);
    } catch (const Impossible& impossible) {
      return Mistake(impossible.what);
    }
  });
}

}  // namespace

std::optional<Message> mirrored(const Entry& entry) {
  if (const auto* request = std::get_if<Request>(&entry.sample)) {
    return mirror(*request, entry);
  }
  if (const auto* reply = std::get_if<Reply>(&entry.sample)) {
    return mirror(*reply, entry);
  }
  if (const auto* withdrawal = std::get_if<Withdrawal>(&entry.sample)) {
    return mirror(*withdrawal, entry);
  }
  if (const auto* event = std::get_if<Event>(&entry.sample)) {
    return mirror(*event, entry);
  }
  return std::nullopt;
}

bool is_mirror(std::string_view channel) {
  return channel.starts_with(prefix);
}

tl::expected<Entry, std::string> entry_of(std::string_view channel, std::string_view bytes) {
  const std::string_view kind = is_mirror(channel) ? channel.substr(prefix.size()) : channel;
  if (kind == "request") {
    return read<mirror_request_t>(bytes);
  }
  if (kind == "reply") {
    return read<mirror_reply_t>(bytes);
  }
  if (kind == "withdrawal") {
    return read<mirror_withdrawal_t>(bytes);
  }
  if (kind == "event") {
    return read<mirror_event_t>(bytes);
  }
  return Mistake(fmt::format("nothing is mirrored on {}", channel));
}

}  // namespace millrace::fabric::lcm
