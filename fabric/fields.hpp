// The fields of a value in one list, which every view of the value reads: wire, recording, JSON,
// CSV.
//
//   struct Outcome { InstanceId responder{}; InstanceId command{}; bool done = false; … };
//   MILLRACE_FIELDS(Outcome, responder, (command, .proto = "token", .on_wire = false), done, …)
//
// A field reaches into each struct that has a member of its name: the value, and the C struct that
// idlc generates, where a duration ends in _ns. The one rule of flattening: a member that has
// fields itself, and that the other struct does not have, stands there field by field.
#pragma once

#include <cstddef>
#include <string_view>
#include <type_traits>

namespace millrace::fabric {

/// Where a view deviates from the field's type.
struct FieldOptions {
  /// Its name in JSON and CSV, in the messages of a recording, and in error messages, where that is
  /// another one.
  std::string_view json{};
  std::string_view proto{};
  std::string_view words{};
  /// A number that people write in hexadecimal.
  bool hex = false;
  /// A text in the controller's code page.
  bool cp1252 = false;
  /// JSON leaves it out if it is empty or 0.
  bool sparse = false;
  /// A channel that must have a machine.
  bool required = false;
  /// False: the C struct has no member of this name. If the field is sent, fabric/wire/codec.cpp
  /// does it. Of an identity: it is not announced.
  bool on_wire = true;
  /// False: it is in no recording, JSON or CSV.
  bool observed = true;
  /// Bytes of a text, or elements of a list, that fit; 0 = as many as there are.
  std::size_t most = 0;
};

template <typename Get>
struct Field {
  std::string_view name;
  Get get;
  FieldOptions options;
};
template <typename Get>
constexpr Field<Get> field(std::string_view name, Get get, FieldOptions options) {
  return {name, get, options};
}

#define MILLRACE_GET(member)                 \
  [](auto& it) -> auto& requires requires {  \
    it.member;                               \
  } || requires {                            \
    it.member##_ns;                          \
  }                                          \
  {                                          \
    if constexpr (requires { it.member; }) { \
      return it.member;                      \
    } else {                                 \
      return it.member##_ns;                 \
    }                                        \
  }
#define MILLRACE_FIELD(member, ...) \
  visit(::millrace::fabric::field(#member, MILLRACE_GET(member), {__VA_ARGS__}));
// The preprocessor does not expand a macro within itself; each scan of the result expands it once
// more.
#define MILLRACE_SCAN(...) MILLRACE_SCAN_9(MILLRACE_SCAN_9(MILLRACE_SCAN_9(__VA_ARGS__)))
#define MILLRACE_SCAN_9(...) MILLRACE_SCAN_3(MILLRACE_SCAN_3(MILLRACE_SCAN_3(__VA_ARGS__)))
#define MILLRACE_SCAN_3(...) MILLRACE_SCAN_1(MILLRACE_SCAN_1(MILLRACE_SCAN_1(__VA_ARGS__)))
#define MILLRACE_SCAN_1(...) __VA_ARGS__
#define MILLRACE_EACH(first, ...)                                     \
  MILLRACE_FIELD_OF(MILLRACE_JOIN(MILLRACE_NO_, MILLRACE_BARE first)) \
  __VA_OPT__(MILLRACE_EACH_AGAIN MILLRACE_PARENTHESES(__VA_ARGS__))
#define MILLRACE_EACH_AGAIN() MILLRACE_EACH
#define MILLRACE_PARENTHESES ()
#define MILLRACE_FIELD_OF(...) MILLRACE_FIELD(__VA_ARGS__)
// A name, or (name, options): without its parentheses.
#define MILLRACE_BARE(...) MILLRACE_BARE __VA_ARGS__
#define MILLRACE_NO_MILLRACE_BARE
#define MILLRACE_JOIN(...) MILLRACE_JOIN_EXPANDED(__VA_ARGS__)
#define MILLRACE_JOIN_EXPANDED(first, ...) first##__VA_ARGS__
/// Stands below `Value`, in its namespace.
#define MILLRACE_FIELDS(Value, ...)                                         \
  template <typename Visit>                                                 \
  constexpr void each_field(const Value* /*of this type*/, Visit&& visit) { \
    MILLRACE_SCAN(MILLRACE_EACH(__VA_ARGS__))                               \
  }

template <typename T>
concept HasFields = requires(const std::remove_cvref_t<T>* value) {
  each_field(value, [](const auto&) {});
};

/// Calls `visit` with each Field of `Value`.
template <HasFields Value, typename Visit>
constexpr void for_each_field(Visit&& visit) {
  each_field(static_cast<const Value*>(nullptr), visit);
}

struct Anything {
  template <typename T>
  operator T() const;
};

/// Members of an aggregate.
template <typename Value, typename... Members>
constexpr std::size_t arity_of() {
  if constexpr (requires { Value{Members{}..., Anything{}}; }) {
    return arity_of<Value, Members..., Anything>();
  } else {
    return sizeof...(Members);
  }
}
/// Whether no member of `Value` was forgotten in its list. Each view asserts it.
template <HasFields Value>
constexpr bool is_complete() {
  std::size_t fields = 0;
  for_each_field<Value>([&](const auto&) { ++fields; });
  return fields == arity_of<Value>();
}

}  // namespace millrace::fabric
