#include "cnc/simulator/type.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <charconv>

#include "cnc/ads/bytes.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::simulator {

namespace {

/// In the order of Type, from boolean.
constexpr std::array<nc::VariableType, 9> in_programs{
    nc::VariableType::boolean, nc::VariableType::sgn08,  nc::VariableType::uns08,
    nc::VariableType::sgn16,   nc::VariableType::uns16,  nc::VariableType::sgn32,
    nc::VariableType::uns32,   nc::VariableType::real64, nc::VariableType::string,
};

ads::Bytes text_bytes(std::uint32_t size, std::string_view text) {
  ads::Bytes bytes(size, 0);
  std::copy(text.begin(), text.end(), bytes.begin());
  return bytes;
}

/// The bytes of a number that fits its type.
ads::Bytes number_bytes(Type type, double number) {
  if (type == Type::real64) {
    return ads::ByteWriter().u64(std::bit_cast<std::uint64_t>(number)).take();
  }
  // The low bytes of the two's complement are the value in each of the narrower types.
  const auto bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(number));
  ads::Bytes bytes = ads::ByteWriter().u64(bits).take();
  bytes.resize(size_of(type));
  return bytes;
}

}  // namespace

nc::Value zero_of(ElementType element) {
  return element.type == Type::string ? nc::Value(std::string()) : nc::Value(0.0);
}

std::optional<nc::Value> value_of(ElementType element, const std::string& text) {
  nc::Value value = text;
  if (element.type != Type::string) {
    double number = text == "TRUE" ? 1.0 : 0.0;
    const char* const last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data(), last, number);
    const bool is_number = error == std::errc{} && end == last;
    if (!is_number && text != "TRUE" && text != "FALSE") {
      return std::nullopt;
    }
    value = number;
  }
  const auto bytes = encode(element, value);
  return bytes ? std::optional(decode(element, *bytes)) : std::nullopt;
}

nc::VariableShape shape_of(ElementType element) {
  const std::size_t characters = element.type == Type::string ? element.size - 1 : 0;
  return {in_programs.at(static_cast<std::size_t>(element.type) - 1), characters, {}};
}

ElementType element_of(const nc::VariableShape& shape) {
  const auto* const found = std::find(in_programs.begin(), in_programs.end(), shape.type);
  const Type type{static_cast<std::uint32_t>(found - in_programs.begin()) + 1};
  return type == Type::string ? ElementType::text(static_cast<std::uint32_t>(shape.length))
                              : ElementType::number(type);
}

nc::Value decode(ElementType element, ads::BytesView bytes) {
  assert(bytes.size() == element.size);
  ads::ByteReader in(bytes);
  switch (element.type) {
    case Type::boolean:
      return in.u8() != 0 ? 1.0 : 0.0;
    case Type::sgn08:
      return static_cast<double>(static_cast<std::int8_t>(in.u8()));
    case Type::uns08:
      return static_cast<double>(in.u8());
    case Type::sgn16:
      return static_cast<double>(static_cast<std::int16_t>(in.u16()));
    case Type::uns16:
      return static_cast<double>(in.u16());
    case Type::sgn32:
      return static_cast<double>(static_cast<std::int32_t>(in.u32()));
    case Type::uns32:
      return static_cast<double>(in.u32());
    case Type::real64:
      return std::bit_cast<double>(in.u64());
    case Type::string:
      break;
  }
  return std::string(ads::text_in(bytes));
}

tl::expected<ads::Bytes, nc::Fault> encode(ElementType element, const nc::Value& value) {
  return nc::values::fit(shape_of(element), value).map([&](const nc::Value& fitting) {
    const auto* text = std::get_if<std::string>(&fitting);
    return text != nullptr ? text_bytes(element.size, *text)
                           : number_bytes(element.type, std::get<double>(fitting));
  });
}

ads::Result<ads::Bytes> accept(ElementType element, ads::BytesView written) {
  if (element.type == Type::string) {
    const std::string_view text = ads::text_in(written);
    if (written.size() > element.size || text.size() >= element.size) {
      return tl::unexpected(ads::ErrorCode::invalid_size);
    }
    return text_bytes(element.size, text);
  }
  if (written.size() != element.size) {
    return tl::unexpected(ads::ErrorCode::invalid_size);
  }
  return ads::Bytes(written.begin(), written.end());
}

}  // namespace millrace::cnc::simulator
