#include "cnc/ads/data_types.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <limits>

#include <fmt/format.h>

namespace millrace::cnc::ads {
namespace {

struct BaseType {
  std::string_view name;
  std::uint32_t size;
  std::uint32_t number;
};

constexpr std::array<BaseType, 15> base_types{{
    {"BOOL", 1, 33},
    {"SINT", 1, 16},
    {"BYTE", 1, 17},
    {"USINT", 1, 17},
    {"INT", 2, 2},
    {"WORD", 2, 18},
    {"UINT", 2, 18},
    {"DINT", 4, 3},
    {"DWORD", 4, 19},
    {"UDINT", 4, 19},
    {"LINT", 8, 20},
    {"LWORD", 8, 21},
    {"ULINT", 8, 21},
    {"REAL", 4, 4},
    {"LREAL", 8, 5},
}};
constexpr std::uint32_t text_number = 30;
/// Length of a STRING without a length, by IEC 61131-3.
constexpr std::uint32_t usual_text = 80;
constexpr int deepest_nesting = 8;
/// Longer than any type name here; the lengths of an entry have 16 bits.
constexpr std::size_t longest_name = 255;

// Flags of an entry.
constexpr std::uint32_t is_type = 1;
constexpr std::uint32_t is_item = 2;

char upper(char c) {
  return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
}

bool same(std::string_view left, std::string_view other) {
  return std::ranges::equal(left, other, {}, upper, upper);
}

/// The part of a name that is not parsed yet.
class Rest {
 public:
  explicit Rest(std::string_view text) : text_(text) {}

  bool take(std::string_view word) {
    skip_blanks();
    if (text_.size() < word.size() || !same(text_.substr(0, word.size()), word)) {
      return false;
    }
    text_.remove_prefix(word.size());
    return true;
  }
  template <class T>
  std::optional<T> number() {
    skip_blanks();
    T value{};
    const auto [at, error] = std::from_chars(text_.data(), text_.data() + text_.size(), value);
    if (error != std::errc()) {
      return std::nullopt;
    }
    text_.remove_prefix(static_cast<std::size_t>(at - text_.data()));
    return value;
  }
  std::string_view all() {
    skip_blanks();
    return text_;
  }

 private:
  void skip_blanks() {
    while (text_.starts_with(' ')) {
      text_.remove_prefix(1);
    }
  }

  std::string_view text_;
};

std::optional<DataType> text_type(Rest rest) {
  std::uint32_t characters = usual_text;
  if (!rest.all().empty()) {
    const bool bracket = rest.take("[");
    if (!bracket && !rest.take("(")) {
      return std::nullopt;
    }
    const auto length = rest.number<std::uint16_t>();
    if (!length || !rest.take(bracket ? "]" : ")") || !rest.all().empty()) {
      return std::nullopt;
    }
    characters = *length;
  }
  return DataType{
      .name = fmt::format("STRING({})", characters), .size = characters + 1, .number = text_number};
}

std::optional<ArrayBounds> bounds_of(Rest& rest) {
  const auto lower = rest.number<std::int32_t>();
  if (!lower || !rest.take("..")) {
    return std::nullopt;
  }
  const auto upper_bound = rest.number<std::int32_t>();
  if (!upper_bound || *upper_bound < *lower) {
    return std::nullopt;
  }
  const auto elements = std::int64_t{*upper_bound} - *lower + 1;
  if (elements > std::numeric_limits<std::uint32_t>::max()) {
    return std::nullopt;
  }
  return ArrayBounds{*lower, static_cast<std::uint32_t>(elements)};
}

std::optional<DataType> find_type(std::string_view name, const Structures& structures, int depth);

std::optional<DataType> array_type(Rest rest, const Structures& structures, int depth) {
  DataType type;
  do {
    const auto bounds = bounds_of(rest);
    if (!bounds) {
      return std::nullopt;
    }
    type.bounds.push_back(*bounds);
  } while (rest.take(","));
  if (!rest.take("]") || !rest.take("OF ")) {
    return std::nullopt;
  }
  const auto element = find_type(rest.all(), structures, depth + 1);
  if (!element) {
    return std::nullopt;
  }
  std::uint64_t size = element->size;
  for (const ArrayBounds& bounds : type.bounds) {
    size *= bounds.elements;
    if (size > std::numeric_limits<std::uint32_t>::max()) {
      return std::nullopt;
    }
  }
  type.size = static_cast<std::uint32_t>(size);
  type.number = element->number;
  type.element_type = element->name;
  type.name = array_name(type.bounds, element->name);
  return type;
}

std::optional<DataType> find_type(std::string_view name, const Structures& structures, int depth) {
  const auto* const base =
      std::ranges::find_if(base_types, [&](const BaseType& type) { return same(type.name, name); });
  if (base != base_types.end()) {
    return DataType{.name = std::string(base->name), .size = base->size, .number = base->number};
  }
  Rest rest(name);
  if (rest.take("STRING")) {
    if (auto text = text_type(rest)) {
      return text;
    }
  }
  if (depth < deepest_nesting && rest.take("ARRAY") && rest.take("[")) {
    return array_type(rest, structures, depth);
  }
  return structures(name);
}

std::uint16_t length_of(std::string_view text) {
  return static_cast<std::uint16_t>(text.size());
}

struct Entry {
  std::string_view name;
  std::string_view type;
  std::uint32_t size = 0;
  std::uint32_t offset = 0;
  std::uint32_t number = 0;
  std::uint32_t flags = 0;
  const std::vector<ArrayBounds>& bounds;
  const std::vector<Bytes>& items;
};

Bytes encode(const Entry& entry) {
  ByteWriter body;
  body.u32(1).u32(0).u32(0);  // version, no hashes
  body.u32(entry.size).u32(entry.offset).u32(entry.number).u32(entry.flags);
  body.u16(length_of(entry.name)).u16(length_of(entry.type)).u16(0);
  body.u16(static_cast<std::uint16_t>(entry.bounds.size()));
  body.u16(static_cast<std::uint16_t>(entry.items.size()));
  body.text(entry.name).u8(0).text(entry.type).u8(0).u8(0);
  for (const ArrayBounds& bounds : entry.bounds) {
    body.u32(static_cast<std::uint32_t>(bounds.lower)).u32(bounds.elements);
  }
  for (const Bytes& item : entry.items) {
    body.bytes(item);
  }
  ByteWriter out;
  out.u32(static_cast<std::uint32_t>(body.size() + 4));
  return out.bytes(body.take()).take();
}

}  // namespace

std::optional<DataType> data_type(std::string_view name, const Structures& structures) {
  return name.size() > longest_name ? std::nullopt : find_type(name, structures, 0);
}

std::string array_name(const std::vector<ArrayBounds>& bounds, std::string_view element_type) {
  std::string name = "ARRAY [";
  for (const ArrayBounds& dimension : bounds) {
    name += fmt::format("{}{}..{}", name.back() == '[' ? "" : ",", dimension.lower,
                        std::int64_t{dimension.lower} + dimension.elements - 1);
  }
  return fmt::format("{}] OF {}", name, element_type);
}

Bytes encode(const DataType& type, const Structures& structures) {
  std::vector<Bytes> items;
  const std::vector<ArrayBounds> none;
  const std::vector<Bytes> no_items;
  for (const DataItem& item : type.items) {
    const auto of = data_type(item.type, structures);
    items.push_back(encode(Entry{item.name, item.type, item.size, item.offset,
                                 of ? of->number : DataType{}.number, is_item, none, no_items}));
  }
  return encode(
      Entry{type.name, type.element_type, type.size, 0, type.number, is_type, type.bounds, items});
}

}  // namespace millrace::cnc::ads
