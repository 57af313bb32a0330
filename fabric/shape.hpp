// The list of a value's fields as data, for views that are no template: recordings, JSON, CSV,
// identities.
//
//   for (const Leaf& leaf : shape_of<Request>()) … leaf.name, leaf.kind, leaf.at(&request)
#pragma once

#include <array>
#include <chrono>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "fabric/data.hpp"
#include "fabric/fields.hpp"
#include "fabric/messages.hpp"
#include "fabric/words.hpp"

namespace millrace::fabric {

/// Of a member; the numbers stand first.
enum class Kind : std::uint8_t {
  boolean,
  /// An enumeration of one byte.
  word,
  u16,
  u32,
  u64,
  i64,
  real,
  time,
  nanoseconds,
  milliseconds,
  maybe_u32,
  maybe_i64,
  id,
  text,
  /// A sentence as data.
  message,
  scope,
  /// It has fields itself.
  shape,
  list
};

struct Leaf;
using Shape = std::span<const Leaf>;

struct Leaf {
  std::string_view name;
  FieldOptions options{};
  Kind kind{};
  /// The member of a value.
  void* (*member)(void* value) = nullptr;
  /// Of Kind::word.
  std::string_view (*word)(std::uint8_t) = nullptr;
  /// Of Kind::shape, and of a list of such.
  Shape (*shape)() = nullptr;
  /// Of Kind::list.
  Kind element{};
  std::size_t (*size)(const void* list) = nullptr;
  const void* (*get)(const void* list, std::size_t) = nullptr;
  void* (*add)(void* list) = nullptr;

  [[nodiscard]] const void* at(const void* value) const { return member(const_cast<void*>(value)); }
};

template <HasFields Value>
Shape shape_of();

/// A member or an element with its type.
template <typename T>
const T& as(const void* member) {
  return *static_cast<const T*>(member);
}
template <typename T>
T& as(void* member) {
  return *static_cast<T*>(member);
}

/// Of each kind up to milliseconds; a real by its bits.
inline std::uint64_t number_of(Kind kind, const void* member) {
  switch (kind) {
    case Kind::boolean:
      return as<bool>(member) ? 1 : 0;
    case Kind::word:
      return as<std::uint8_t>(member);
    case Kind::u16:
      return as<std::uint16_t>(member);
    case Kind::u32:
      return as<std::uint32_t>(member);
    default:
      std::uint64_t number = 0;
      std::memcpy(&number, member, sizeof number);
      return number;
  }
}
inline void set_number(Kind kind, void* member, std::uint64_t number) {
  switch (kind) {
    case Kind::boolean:
      as<bool>(member) = number != 0;
      break;
    case Kind::word:
      as<std::uint8_t>(member) = static_cast<std::uint8_t>(number);
      break;
    case Kind::u16:
      as<std::uint16_t>(member) = static_cast<std::uint16_t>(number);
      break;
    case Kind::u32:
      as<std::uint32_t>(member) = static_cast<std::uint32_t>(number);
      break;
    case Kind::maybe_u32:
      as<std::optional<std::uint32_t>>(member) = static_cast<std::uint32_t>(number);
      break;
    case Kind::maybe_i64:
      as<std::optional<std::int64_t>>(member) = static_cast<std::int64_t>(number);
      break;
    default:
      std::memcpy(member, &number, sizeof number);
  }
}

template <typename Member>
constexpr Kind kind_of_member() {
  if constexpr (std::same_as<Member, bool>) {
    return Kind::boolean;
  } else if constexpr (std::is_enum_v<Member>) {
    static_assert(sizeof(Member) == 1);
    return Kind::word;
  } else if constexpr (std::same_as<Member, std::uint16_t>) {
    return Kind::u16;
  } else if constexpr (std::same_as<Member, std::uint32_t>) {
    return Kind::u32;
  } else if constexpr (std::same_as<Member, std::uint64_t>) {
    return Kind::u64;
  } else if constexpr (std::same_as<Member, std::int64_t>) {
    return Kind::i64;
  } else if constexpr (std::same_as<Member, double>) {
    return Kind::real;
  } else if constexpr (std::same_as<Member, Time>) {
    return Kind::time;
  } else if constexpr (std::same_as<Member, std::chrono::nanoseconds>) {
    return Kind::nanoseconds;
  } else if constexpr (std::same_as<Member, std::chrono::milliseconds>) {
    return Kind::milliseconds;
  } else if constexpr (std::same_as<Member, std::optional<std::uint32_t>>) {
    return Kind::maybe_u32;
  } else if constexpr (std::same_as<Member, std::optional<std::int64_t>>) {
    return Kind::maybe_i64;
  } else if constexpr (std::same_as<Member, InstanceId>) {
    return Kind::id;
  } else if constexpr (std::same_as<Member, std::string>) {
    return Kind::text;
  } else if constexpr (std::same_as<Member, Message>) {
    return Kind::message;
  } else if constexpr (std::same_as<Member, ChannelScope>) {
    return Kind::scope;
  } else if constexpr (HasFields<Member>) {
    return Kind::shape;
  } else {
    return Kind::list;
  }
}

/// A list is a member, or the alternative of Elements that is one; then it is empty while another
/// alternative has the elements.
template <typename List, typename Member>
constexpr void make_list(Leaf& leaf) {
  using Element = typename List::value_type;
  leaf.kind = Kind::list;
  leaf.element = kind_of_member<Element>();
  if constexpr (HasFields<Element>) {
    leaf.shape = &shape_of<Element>;
  }
  if constexpr (std::same_as<List, Member>) {
    leaf.size = [](const void* list) { return as<List>(list).size(); };
    leaf.get = [](const void* list, std::size_t i) -> const void* { return &as<List>(list)[i]; };
    leaf.add = [](void* list) -> void* { return &as<List>(list).emplace_back(); };
  } else {
    leaf.size = [](const void* all) {
      const auto* const list = std::get_if<List>(&as<Member>(all));
      return list == nullptr ? std::size_t{0} : list->size();
    };
    leaf.get = [](const void* all, std::size_t i) -> const void* {
      return &std::get<List>(as<Member>(all))[i];
    };
    leaf.add = [](void* all) -> void* {
      auto& elements = as<Member>(all);
      if (!std::holds_alternative<List>(elements)) {
        elements.template emplace<List>();
      }
      return &std::get<List>(elements).emplace_back();
    };
  }
}

template <typename Value, typename Get>
using MemberOf = std::remove_cvref_t<decltype(std::declval<Get>()(std::declval<Value&>()))>;

template <typename Value, typename Get>
constexpr Leaf leaf_of(const Field<Get>& field) {
  using Member = MemberOf<Value, Get>;
  Leaf leaf{.name = field.name,
            .options = field.options,
            .kind = kind_of_member<Member>(),
            .member = [](void* value) -> void* { return &Get{}(as<Value>(value)); }};
  if constexpr (std::is_enum_v<Member>) {
    leaf.word = [](std::uint8_t number) { return name_of(static_cast<Member>(number)); };
  } else if constexpr (HasFields<Member>) {
    leaf.shape = &shape_of<Member>;
  } else if constexpr (requires(Member & it) { it.emplace_back(); }) {
    make_list<Member, Member>(leaf);
  }
  return leaf;
}

template <HasFields Value>
constexpr auto leaves_of() {
  static_assert(is_complete<Value>(), "a member of the value is not in its list");
  constexpr std::size_t count = [] {
    std::size_t leaves = 0;
    for_each_field<Value>([&]<typename Get>(const Field<Get>&) {
      leaves += std::same_as<MemberOf<Value, Get>, Elements> ? std::variant_size_v<Elements> : 1;
    });
    return leaves;
  }();
  std::array<Leaf, count> leaves{};
  std::size_t next = 0;
  for_each_field<Value>([&]<typename Get>(const Field<Get>& field) {
    if constexpr (std::same_as<MemberOf<Value, Get>, Elements>) {
      for (const char* name : {"integer", "real", "text"}) {
        leaves[next] = leaf_of<Value>(field);
        leaves[next++].name = name;
      }
      make_list<std::vector<std::int64_t>, Elements>(leaves[next - 3]);
      make_list<std::vector<double>, Elements>(leaves[next - 2]);
      make_list<std::vector<std::string>, Elements>(leaves[next - 1]);
    } else {
      leaves[next++] = leaf_of<Value>(field);
    }
  });
  return leaves;
}
template <HasFields Value>
inline constexpr auto leaves = leaves_of<Value>();
template <HasFields Value>
Shape shape_of() {
  return leaves<Value>;
}

}  // namespace millrace::fabric
