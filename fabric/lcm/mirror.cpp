#include "fabric/lcm/mirror.hpp"

#include <millrace/mirror_event_t.hpp>
#include <millrace/mirror_reply_t.hpp>
#include <millrace/mirror_request_t.hpp>
#include <millrace/mirror_withdrawal_t.hpp>

#include "base/text/ascii.hpp"
#include "base/text/cp1252.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/lcm/message.hpp"
#include "fabric/messages.hpp"
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

std::string without_nul(const std::string& text) {
  return replaced(text, std::string_view("\0", 1), null_symbol);
}
std::string shown(const std::string& cp1252) {
  return without_nul(base::text::to_utf8(cp1252));
}

std::int64_t count(Time time) {
  return time.time_since_epoch().count();
}
Time time_of(std::int64_t nanoseconds) {
  return Time(std::chrono::nanoseconds(nanoseconds));
}

/// A UUID and the texts of a program are bytes of its controller.
bool is_cp1252(std::string_view name, const FieldOptions& options) {
  return options.cp1252 || name == "uuid";
}

/// One field of a value in its message; what is called otherwise there, mirror() adds.
class Putter {
 public:
  template <typename Value, typename To>
  static void all(const Value& value, To& to) {
    for_each_field<Value>([&](const auto& field) {
      const auto& from = field.get(value);
      if constexpr (!requires { field.get(to); }) {
        if constexpr (HasFields<decltype(from)>) {
          all(from, to);
        }
      } else if constexpr (std::is_same_v<decltype(from), const fabric::Message&>) {
        field.get(to) = without_nul(from.text);
      } else if constexpr (std::is_same_v<decltype(from), const std::string&>) {
        field.get(to) = is_cp1252(field.name, field.options) ? shown(from) : without_nul(from);
      } else {
        put(from, field.get(to));
      }
    });
  }

 private:
  static void put(Time from, std::int64_t& to) { to = count(from); }
  static void put(const CallId& from, std::string& to) { to = from.to_string(); }
  static void put(const InstanceId& from, std::string& to) { to = from.to_string(); }
  /// An epoch.
  static void put(std::uint64_t from, std::string& to) { to = fmt::format("{:x}", from); }
  static void put(EventKind from, std::string& to) { to = name_of(from); }
  template <typename From, std::integral To>
  static void put(From from, To& to) {
    to = static_cast<To>(from);
  }
};

template <typename To, typename Sample>
Message mirror(const Sample& sample, const Entry& entry) {
  To to;
  Putter::all(sample, to);
  if constexpr (requires { to.happened; }) {
    to.happened = count(sample.at);
  }
  if constexpr (requires { sample.assigned; }) {
    to.instance = sample.assigned.to_string();
  }
  if constexpr (!requires { sample.uuid; }) {
    to.uuid = shown(entry.uuid);
  }
  if constexpr (requires { to.withheld; }) {
    to.withheld = entry.withheld ? static_cast<std::int32_t>(*entry.withheld) : not_withheld;
  }
  to.at = count(entry.at);
  return {.channel = std::string(prefix) + std::string(kind_of(entry)), .bytes = encode(to)};
}

using Mistake = tl::unexpected<std::string>;

/// Thrown for an impossible value in a foreign message, and caught below.
struct Impossible {
  std::string what;
};

std::string cp1252_of(const std::string& utf8, std::string_view field) {
  // The order matters: a NUL is not a character that CP1252 lacks.
  auto text = base::text::to_cp1252(replaced(utf8, null_symbol, std::string_view("\0", 1)));
  if (!text) {
    throw Impossible{fmt::format("its {}: {}", field, text.error())};
  }
  return *std::move(text);
}

std::uint32_t number_of(std::int64_t number, std::string_view field) {
  if (number < 0 || number > 0xFFFF'FFFF) {
    throw Impossible{fmt::format("its {} is {}", field, number)};
  }
  return static_cast<std::uint32_t>(number);
}

/// The other way.
class Getter {
 public:
  template <typename From, typename Value>
  static void all(const From& from, Value& value) {
    for_each_field<Value>([&](const auto& field) {
      auto& to = field.get(value);
      if constexpr (!requires { field.get(from); }) {
        if constexpr (HasFields<decltype(to)>) {
          all(from, to);
        }
      } else if constexpr (std::is_same_v<decltype(to), fabric::Message&>) {
        to = replaced(field.get(from), null_symbol, std::string_view("\0", 1));
      } else if constexpr (std::is_same_v<decltype(to), std::string&>) {
        to = is_cp1252(field.name, field.options)
                 ? cp1252_of(field.get(from),
                             field.options.words.empty() ? field.name : field.options.words)
                 : replaced(field.get(from), null_symbol, std::string_view("\0", 1));
      } else {
        get(field.get(from), to, field.name);
      }
    });
  }
  static InstanceId instance_of(const std::string& text) {
    return known(InstanceId::parse(text), "it names no instance");
  }

 private:
  static void get(std::int64_t from, Time& to, std::string_view) { to = time_of(from); }
  static void get(const std::string& from, CallId& to, std::string_view) {
    to = known(parse_call_id(from), "it names no call");
  }
  static void get(const std::string& from, InstanceId& to, std::string_view) {
    to = instance_of(from);
  }
  static void get(const std::string& from, std::uint64_t& to, std::string_view) {
    to = known(base::text::parse_number<std::uint64_t>(from, 16), "it succeeds no epoch");
  }
  static void get(const std::string& from, EventKind& to, std::string_view) {
    // Also "unknown (200)", the kind of a later version.
    for (int number = 0; number < 256; ++number) {
      to = static_cast<EventKind>(number);
      if (name_of(to) == from) {
        return;
      }
    }
    throw Impossible{"its kind of event is not known"};
  }
  static void get(std::int8_t from, bool& to, std::string_view) { to = from != 0; }
  static void get(std::int64_t from, std::uint32_t& to, std::string_view field) {
    to = number_of(from, field);
  }
  static void get(std::int32_t from, std::uint16_t& to, std::string_view) {
    if (from < 0 || from > 0xFFFF) {
      throw Impossible{"it names no channel of a machine"};
    }
    to = static_cast<std::uint16_t>(from);
  }
  template <typename To>
  requires std::is_enum_v<To>
  static void get(std::int8_t from, To& to, std::string_view field) {
    to = static_cast<To>(from);
    if (from < 0 || name_of(to).starts_with("unknown")) {
      throw Impossible{fmt::format("its {} is {}", field, from)};
    }
  }
  template <typename Known>
  static typename Known::value_type known(const Known& value, const char* otherwise) {
    if (!value) {
      throw Impossible{otherwise};
    }
    return *value;
  }
};

template <typename Sample, typename From>
Entry unmirror(const From& from) {
  // A tool that calls is a machine as well, of a name that no configuration would take.
  if (from.machine.size() > longest_machine_name) {
    throw Impossible{"it names no channel of a machine"};
  }
  Sample sample;
  Getter::all(from, sample);
  Entry entry{.at = time_of(from.at), .uuid = cp1252_of(from.uuid, "UUID")};
  if constexpr (requires { from.happened; }) {
    sample.at = time_of(from.happened);
  }
  if constexpr (requires { sample.assigned; }) {
    sample.assigned = Getter::instance_of(from.instance);
  }
  if constexpr (requires { sample.uuid; }) {
    entry.uuid = canonical_uuid(sample.uuid);
  }
  if constexpr (requires { from.withheld; }) {
    if (from.withheld != not_withheld) {
      entry.withheld = number_of(from.withheld, "size");
    }
  }
  entry.sample = std::move(sample);
  return entry;
}

template <typename From, typename Sample>
tl::expected<Entry, std::string> read(std::string_view bytes) {
  return decode<From>(bytes).and_then([](const From& value) -> tl::expected<Entry, std::string> {
    try {
      return unmirror<Sample>(value);
    } catch (const Impossible& impossible) {
      return Mistake(impossible.what);
    }
  });
}

}  // namespace

std::optional<Message> mirrored(const Entry& entry) {
  if (const auto* request = std::get_if<Request>(&entry.sample)) {
    return mirror<mirror_request_t>(*request, entry);
  }
  if (const auto* reply = std::get_if<Reply>(&entry.sample)) {
    return mirror<mirror_reply_t>(*reply, entry);
  }
  if (const auto* withdrawal = std::get_if<Withdrawal>(&entry.sample)) {
    return mirror<mirror_withdrawal_t>(*withdrawal, entry);
  }
  if (const auto* event = std::get_if<Event>(&entry.sample)) {
    return mirror<mirror_event_t>(*event, entry);
  }
  return std::nullopt;
}

bool is_mirror(std::string_view channel) {
  return channel.starts_with(prefix);
}

tl::expected<Entry, std::string> entry_of(std::string_view channel, std::string_view bytes) {
  const std::string_view kind = is_mirror(channel) ? channel.substr(prefix.size()) : channel;
  if (kind == "request") {
    return read<mirror_request_t, Request>(bytes);
  }
  if (kind == "reply") {
    return read<mirror_reply_t, Reply>(bytes);
  }
  if (kind == "withdrawal") {
    return read<mirror_withdrawal_t, Withdrawal>(bytes);
  }
  if (kind == "event") {
    return read<mirror_event_t, Event>(bytes);
  }
  return Mistake(fmt::format("nothing is mirrored on {}", channel));
}

}  // namespace millrace::fabric::lcm
