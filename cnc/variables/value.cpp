#include "cnc/variables/value.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "cnc/variables/addresses.hpp"
#include "cnc/variables/names.hpp"

namespace millrace::cnc::variables {

namespace {

bool is_signed(Type type) {
  return type == Type::sgn08 || type == Type::sgn16 || type == Type::sgn32;
}

constexpr int bits_per_byte = 8;
constexpr int bits_of_value = 64;

Element decode_one(ElementType type, BytesView bytes) {
  if (type.type == Type::string) {
    return decode_text(bytes);
  }
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bits |= std::uint64_t{bytes[i]} << (bits_per_byte * i);
  }
  if (type.type == Type::real64) {
    return std::bit_cast<double>(bits);
  }
  if (type.type == Type::boolean) {
    return bits != 0;
  }
  if (is_signed(type.type)) {
    const int unused = bits_of_value - bits_per_byte * static_cast<int>(type.size);
    return static_cast<std::int64_t>(bits << unused) >> unused;
  }
  return static_cast<std::int64_t>(bits);
}

Bytes low_bytes(std::uint64_t bits, std::uint32_t size) {
  Bytes bytes = ads::ByteWriter().u64(bits).take();
  bytes.resize(size);
  return bytes;
}

tl::expected<Bytes, std::string> encode_boolean(const std::string& text) {
  std::string upper = text;
  std::ranges::transform(upper, upper.begin(), [](char c) {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c;
  });
  if (upper == "TRUE" || upper == "1") {
    return Bytes{1};
  }
  if (upper == "FALSE" || upper == "0") {
    return Bytes{0};
  }
  return tl::unexpected(fmt::format("'{}' is not a BOOLEAN; expected TRUE or FALSE", text));
}

tl::expected<Bytes, std::string> encode_integer(ElementType type, const std::string& text) {
  assert(type.size == size_of(type.type));
  const int bits = bits_per_byte * static_cast<int>(type.size);
  const std::int64_t range = std::int64_t{1} << (is_signed(type.type) ? bits - 1 : bits);
  const std::int64_t lowest = is_signed(type.type) ? -range : 0;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < lowest ||
      value >= range) {
    return tl::unexpected(fmt::format("'{}' is not a {}; expected {} to {}", text,
                                      name_of(type.type), lowest, range - 1));
  }
  return low_bytes(static_cast<std::uint64_t>(value), type.size);
}

tl::expected<Bytes, std::string> encode_real(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    return tl::unexpected(fmt::format("'{}' is not a REAL64; expected a number, as in -3.5", text));
  }
  return low_bytes(std::bit_cast<std::uint64_t>(value), sizeof value);
}

tl::expected<Bytes, std::string> encode_string(ElementType type, const std::string& text) {
  auto bytes = encode_text(text);
  if (bytes && bytes->size() > type.size) {
    return tl::unexpected(
        fmt::format("the text has {} bytes, the variable holds {}", text.size(), type.size - 1));
  }
  return bytes;
}

tl::expected<Bytes, std::string> encode_one(ElementType type, const std::string& text) {
  switch (type.type) {
    case Type::boolean:
      return encode_boolean(text);
    case Type::real64:
      return encode_real(text);
    case Type::string:
      return encode_string(type, text);
    default:
      return encode_integer(type, text);
  }
}

}  // namespace

tl::expected<ElementType, std::string> element_type(const Description& description) {
  std::uint64_t count = 1;
  for (const std::uint32_t length : description.dimensions) {
    count *= length;
    if (count == 0 || count > max_stream) {
      return tl::unexpected(std::string("its array has no elements, or more than can be read"));
    }
  }
  const std::uint32_t size = size_of(description.type);
  if (description.type == Type::string && description.size >= count &&
      description.size % count == 0) {
    return ElementType{Type::string, static_cast<std::uint32_t>(description.size / count)};
  }
  if (size == 0) {
    return tl::unexpected(
        fmt::format("the controller gives it type {} and {} bytes; a CNC has no such value",
                    static_cast<std::uint32_t>(description.type), description.size));
  }
  return ElementType{description.type, size};
}

tl::expected<std::vector<Element>, std::string> decode_elements(ElementType type, BytesView bytes) {
  const bool one_text = type.type == Type::string && bytes.size() <= type.size;
  if (!one_text && (bytes.empty() || bytes.size() % type.size != 0)) {
    return tl::unexpected(fmt::format("the controller sent {} bytes for a {} of {}", bytes.size(),
                                      name_of(type.type), type.size));
  }
  std::vector<Element> elements;
  do {
    const auto element = bytes.first(std::min<std::size_t>(type.size, bytes.size()));
    elements.push_back(decode_one(type, element));
    bytes = bytes.subspan(element.size());
  } while (!bytes.empty());
  return elements;
}

tl::expected<Bytes, std::string> encode_elements(ElementType type,
                                                 const std::vector<std::string>& texts) {
  Bytes all;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    auto bytes = encode_one(type, texts[i]);
    if (!bytes) {
      return texts.size() == 1 ? bytes
                               : tl::unexpected(fmt::format("element {}: {}", i, bytes.error()));
    }
    if (texts.size() > 1) {
      bytes->resize(type.size);  // the strings of an array have buffers of one size
    }
    all.insert(all.end(), bytes->begin(), bytes->end());
  }
  return all;
}

std::string decode_text(ads::BytesView bytes) {
  return std::string(ads::text_in(bytes));
}

tl::expected<ads::Bytes, std::string> encode_text(std::string_view text) {
  if (text.size() > max_text) {
    return tl::make_unexpected(
        fmt::format("the text has {} bytes, a CNC string holds {}", text.size(), max_text));
  }
  if (const auto nul = text.find('\0'); nul != std::string_view::npos) {
    return tl::make_unexpected(
        fmt::format("the text has a NUL at byte {}, where a CNC string would end", nul));
  }
  ads::ByteWriter out;
  return out.text(text).u8(0).take();
}

ads::Result<std::uint32_t> decode_number(BytesView bytes) {
  ads::ByteReader in(bytes);
  const auto number = in.u32();
  return in.exact() ? ads::Result<std::uint32_t>(number)
                    : tl::make_unexpected(ads::ErrorCode::protocol_error);
}

}  // namespace millrace::cnc::variables
