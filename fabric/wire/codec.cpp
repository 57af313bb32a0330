#include "fabric/wire/codec.hpp"

#include <algorithm>
#include <cstring>
#include <span>
#include <type_traits>
#include <variant>

#include <fmt/format.h>

namespace millrace::fabric::wire {

namespace {

template <typename T>
concept Sequence = requires(T& it) {
  it._buffer;
  it._length;
};
/// Parts of a message that are read; ours have fewer.
constexpr std::uint32_t most_parts = 64;

/// Extras of a sample that are read, and their bytes.
constexpr std::uint32_t most_extras = 16;
constexpr std::uint32_t longest_extra = 1024;

std::string without_nul(std::string text) {
  std::erase(text, '\0');
  return text;
}

template <typename T>
concept Number = std::is_arithmetic_v<T>;
template <typename T>
concept Enumeration = std::is_enum_v<T>;

/// Whether each field that travels has a place in the sample.
template <typename Value, typename Sample>
constexpr bool all_have_a_place() {
  bool all = true;
  for_each_field<Value>([&](const auto& field) {
    using Member = std::remove_cvref_t<decltype(field.get(std::declval<Value&>()))>;
    if constexpr (!requires { field.get(std::declval<Sample&>()); } && !HasFields<Member>) {
      all = all && !field.options.on_wire;
    }
  });
  return all;
}

/// Fills a sample; the first field that does not fit becomes the error.
class Putter {
 public:
  explicit Putter(Lists& lists) : lists_(lists) {}

  template <typename Value, typename Sample>
  void all(const Value& value, Sample& sample) {
    static_assert(is_complete<Value>(), "a member of the value is not in its list");
    static_assert(all_have_a_place<Value, Sample>(), "a field is missing in the IDL");
    for_each_field<Value>([&](const auto& field) {
      const auto& from = field.get(value);
      using From = std::remove_cvref_t<decltype(from)>;
      if constexpr (std::is_same_v<From, ChannelKey>) {
        if (field.options.required && from.machine.empty()) {
          fail("the machine has no name");
        }
      }
      if constexpr (requires { field.get(sample); }) {
        words_ = field.options.words.empty() ? field.name : field.options.words;
        most_ = field.options.most;
        put(from, field.get(sample));
      } else if constexpr (HasFields<From>) {
        all(from, sample);
      }
    });
    if constexpr (requires { rest(value, sample); }) {
      rest(value, sample);
    }
  }

  [[nodiscard]] std::string& error() { return error_; }

 private:
  // Fields without a member of the same name in the sample.
  void rest(const InstanceLoad& from, millrace_InstanceLoad& to) const {
    to.waiting = from.status.waiting;
  }
  void rest(const Command& from, millrace_Command& to) { put(from.id, to.token); }
  void rest(const Outcome& from, millrace_Outcome& to) { put(from.command, to.token); }
  void rest(const ProgramEvent& from, millrace_ProgramEvent& to) const {
    to.has_parts = from.parts.has_value();
  }
  void rest(const Value& from, millrace_Value& to) {
    if (const auto* integers = std::get_if<std::vector<std::int64_t>>(&from.elements)) {
      put(*integers, to.integers);
    } else if (const auto* reals = std::get_if<std::vector<double>>(&from.elements)) {
      put(*reals, to.reals);
    } else {
      put(std::get<std::vector<std::string>>(from.elements), to.texts);
    }
  }

  template <std::size_t size>
  void put(const std::string& from, char (&to)[size]) {
    if (from.size() >= size) {
      fail(fmt::format("the {} has {} bytes, at most {} fit", words_, from.size(), size - 1));
    } else if (from.find('\0') != std::string::npos) {
      fail(fmt::format("the {} contains a NUL byte", words_));
    } else {
      std::memcpy(to, from.c_str(), from.size() + 1);
    }
  }
  void put(const InstanceId& from, std::uint8_t (&to)[16]) {
    std::memcpy(to, from.bytes.data(), sizeof to);
  }
  void put(Time from, std::int64_t& to) { to = from.time_since_epoch().count(); }
  void put(std::chrono::nanoseconds from, std::uint64_t& to) {
    to = static_cast<std::uint64_t>(from.count());
  }
  void put(const std::optional<std::int64_t>& from, std::int64_t& to) { to = from.value_or(0); }
  template <Number From>
  void put(From from, From& to) {
    to = from;
  }
  template <Enumeration From>
  void put(From from, std::uint8_t& to) {
    to = static_cast<std::uint8_t>(from);
  }
  /// Of any length: what its reader would drop for a bound is shortened.
  template <Sequence To>
  void put(const Message& from, To& to) {
    std::vector<base::messages::MessagePart> parts = base::messages::parts_of(from);
    for (base::messages::MessagePart& part : parts) {
      part.code.resize(std::min(part.code.size(), sizeof(millrace_MessagePart::code) - 1));
      part.text =
          shortened(without_nul(std::move(part.text)), sizeof(millrace_MessagePart::text) - 1);
    }
    put(parts, to);
  }
  void put(const base::messages::MessagePart& from, millrace_MessagePart& to) {
    put(from.code, to.code);
    to.arguments = from.arguments;
    put(from.text, to.text);
  }
  template <HasFields From, typename To>
  void put(const From& from, To& to) {
    all(from, to);
  }
  template <Sequence To>
  void put(const std::string& from, To& to) {
    if (most_ != 0 && from.size() > most_) {
      fail(fmt::format("the {} has {} bytes, at most {} fit", words_, from.size(), most_));
    }
    // Cyclone only reads the samples that it writes; the pointer is not const because it is a C
    // struct.
    lend(to, reinterpret_cast<std::uint8_t*>(const_cast<char*>(from.data())), from.size());
  }
  template <typename Element, Sequence To>
  void put(const std::vector<Element>& from, To& to) {
    using Its = std::remove_pointer_t<decltype(to._buffer)>;
    const std::string_view words = words_;
    if (most_ != 0 && from.size() > most_) {
      fail(fmt::format("{} {}, at most {} fit", from.size(), words, most_));
    }
    if constexpr (std::is_same_v<Element, Its>) {
      lend(to, const_cast<Element*>(from.data()), from.size());
    } else {
      lists_.push_back(std::make_unique<std::byte[]>(from.size() * sizeof(Its)));
      Its* const list = reinterpret_cast<Its*>(lists_.back().get());
      lend(to, list, from.size());
      for (std::size_t i = 0; i < from.size() && error_.empty(); ++i) {
        put(from[i], *new (list + i) Its{});
        if (!error_.empty()) {
          error_ = fmt::format("{}[{}]: {}", words, i, error_);
        }
      }
    }
  }

  template <Sequence To, typename Element>
  void lend(To& to, Element* first, std::size_t size) {
    to._buffer = first;
    to._length = to._maximum = static_cast<std::uint32_t>(size);
  }
  void fail(std::string error) {
    if (error_.empty()) {
      error_ = std::move(error);
    }
  }

  Lists& lists_;
  /// The name of the current field.
  std::string_view words_;
  std::size_t most_ = 0;
  std::string error_;
};

class Getter {
 public:
  template <typename Sample, typename Value>
  static void all(const Sample& sample, Value& value) {
    for_each_field<Value>([&](const auto& field) {
      auto& to = field.get(value);
      if constexpr (requires { field.get(sample); }) {
        get(field.get(sample), to);
      } else if constexpr (HasFields<decltype(to)>) {
        all(sample, to);
      }
    });
    if constexpr (requires { rest(sample, value); }) {
      rest(sample, value);
    }
  }

  // Fields without a member of the same name in the sample.
  static void rest(const millrace_InstanceLoad& from, InstanceLoad& to) {
    to.status.waiting = std::min(from.waiting, from.calls._length);
    to.status.running = from.calls._length - to.status.waiting;
  }
  static void rest(const millrace_Command& from, Command& to) { get(from.token, to.id); }
  static void rest(const millrace_Outcome& from, Outcome& to) { get(from.token, to.command); }
  static void rest(const millrace_ProgramEvent& from, ProgramEvent& to) {
    if (!from.has_parts) {
      to.parts.reset();
    }
  }
  static void rest(const millrace_Value& from, Value& to) {
    // Of a type that this version does not know, whatever has elements.
    const bool is_known = to.type <= ValueType::string;
    if (is_known ? to.type == ValueType::real64 : from.reals._length > 0) {
      get(from.reals, to.elements.emplace<std::vector<double>>());
    } else if (is_known ? to.type == ValueType::string : from.texts._length > 0) {
      get(from.texts, to.elements.emplace<std::vector<std::string>>());
    } else {
      get(from.integers, to.elements.emplace<std::vector<std::int64_t>>());
    }
  }

 private:
  template <std::size_t size>
  static void get(const char (&from)[size], std::string& to) {
    to = from;
  }
  static void get(const std::uint8_t (&from)[16], InstanceId& to) {
    std::memcpy(to.bytes.data(), from, sizeof from);
  }
  static void get(std::int64_t from, Time& to) { to = Time(std::chrono::nanoseconds(from)); }
  static void get(std::uint64_t from, std::chrono::nanoseconds& to) {
    to = std::chrono::nanoseconds(from);
  }
  static void get(std::int64_t from, std::optional<std::int64_t>& to) { to = from; }
  template <Number To>
  static void get(To from, To& to) {
    to = from;
  }
  /// Its number may have no name in this version.
  template <Enumeration To>
  static void get(std::uint8_t from, To& to) {
    to = static_cast<To>(from);
  }
  template <Sequence From>
  static void get(const From& from, Message& to) {
    std::vector<base::messages::MessagePart> parts(std::min(from._length, most_parts));
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const millrace_MessagePart& part = from._buffer[i];
      parts[i] = {part.code, part.arguments, part.text};
    }
    to = base::messages::message_of(parts);
  }
  template <typename From, HasFields To>
  static void get(const From& from, To& to) {
    all(from, to);
  }
  template <Sequence From>
  static void get(const From& from, std::string& to) {
    to.assign(reinterpret_cast<const char*>(from._buffer), from._length);
  }
  /// A longer one is not kept: it would cost each reader memory, and says nothing to this version.
  static void get(const millrace_Extras& from, Extras& to) {
    for (const millrace_Extra& extra :
         std::span(from._buffer, std::min(from._length, most_extras))) {
      if (extra.bytes._length <= longest_extra) {
        all(extra, to.emplace_back());
      }
    }
  }
  template <Sequence From, typename Element>
  static void get(const From& from, std::vector<Element>& to) {
    to.resize(from._length);
    for (std::size_t i = 0; i < to.size(); ++i) {
      get(from._buffer[i], to[i]);
    }
  }
};

template <Sequence From>
auto elements_of(const From& from) {
  return std::span(from._buffer, from._length);
}

/// Which limit a request exceeds; empty if none.
std::string excess_of(const millrace_VariableRequest& sample) {
  if (sample.names._length > most_variables) {
    return fmt::format("{} names; at most {} are answered in one request", sample.names._length,
                       most_variables);
  }
  if (sample.values._length > most_variables) {
    return fmt::format("values for {} names; at most {} are written in one request",
                       sample.values._length, most_variables);
  }
  std::size_t bytes = 0;
  std::size_t elements = 0;
  for (const millrace_ValueText& name : elements_of(sample.names)) {
    bytes += name._length;
  }
  for (const millrace_ValueTexts& list : elements_of(sample.values)) {
    elements += list._length;
    for (const millrace_ValueText& text : elements_of(list)) {
      bytes += text._length;
    }
  }
  if (bytes > most_variable_bytes) {
    return fmt::format("{} bytes of names and values; at most {} go into one request", bytes,
                       most_variable_bytes);
  }
  return elements > most_variable_elements
             ? fmt::format("{} elements; at most {} are written in one request", elements,
                           most_variable_elements)
             : std::string();
}

}  // namespace

template <typename Value, typename Type, const Topic& its_topic>
tl::expected<BorrowedSample<Type>, std::string> CodecOf<Value, Type, its_topic>::encode(
    const Value& value) {
  tl::expected<BorrowedSample<Type>, std::string> lent;
  Putter putter(lent->lists);
  putter.all(value, static_cast<Type&>(*lent));
  if (!putter.error().empty()) {
    return tl::unexpected(std::move(putter.error()));
  }
  return lent;
}

template <typename Value, typename Type, const Topic& its_topic>
Value CodecOf<Value, Type, its_topic>::decode(const Type& sample) {
  Value value;
  Getter::all(sample, value);
  return value;
}

template <>
VariableRequest Codec<VariableRequest>::CodecOf::decode(const millrace_VariableRequest& sample) {
  VariableRequest value{.excess = excess_of(sample)};
  millrace_VariableRequest taken = sample;
  if (!value.excess.empty()) {
    taken.names = {};
    taken.values = {};
  }
  Getter::all(taken, value);
  return value;
}

template struct CodecOf<Request, millrace_Request, request_topic>;
template struct CodecOf<Reply, millrace_Reply, reply_topic>;
template struct CodecOf<ChannelStatus, millrace_ChannelStatus, channel_topic>;
template struct CodecOf<MachineStatus, millrace_MachineStatus, machine_topic>;
template struct CodecOf<Heartbeat, millrace_Heartbeat, heartbeat_topic>;
template struct CodecOf<Event, millrace_Event, event_topic>;
template struct CodecOf<Command, millrace_Command, command_topic>;
template struct CodecOf<Outcome, millrace_Outcome, outcome_topic>;
template struct CodecOf<DataSample, millrace_DataSample, data_topic>;
template struct CodecOf<ProgramEvent, millrace_ProgramEvent, program_topic>;
template struct CodecOf<Alarm, millrace_Alarm, alarm_topic>;
template struct CodecOf<VariableRequest, millrace_VariableRequest, variable_request_topic>;
template struct CodecOf<VariableReply, millrace_VariableReply, variable_reply_topic>;

}  // namespace millrace::fabric::wire
