#include "cnc/simulator/objects/group.hpp"

#include <cassert>

#include "cnc/ads/bytes.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

constexpr std::uint32_t channel_mask = 0xFF;
constexpr unsigned attribute_shift = 8;
constexpr std::uint32_t attribute_mask = 0xF;

bool is_com(GroupKind kind) {
  return kind == GroupKind::com_channel || kind == GroupKind::com_axis ||
         kind == GroupKind::com_directory;
}

bool is_internal(GroupKind kind) {
  return kind == GroupKind::position_controller || kind == GroupKind::interpolator ||
         kind == GroupKind::decoder || kind == GroupKind::channel_state;
}

/// Objects of the CNC's tasks: the attribute is added to the base, whose own digit there is 3.
std::optional<Group> decode_internal(std::uint32_t number) {
  constexpr std::uint32_t base_digit = 3;
  const std::uint32_t digit = (number >> attribute_shift) & attribute_mask;
  const std::uint32_t attribute = digit - base_digit;
  const GroupKind kind{(number & ~channel_mask) - (attribute << attribute_shift)};
  if (attribute > static_cast<std::uint32_t>(Attribute::address) || !is_internal(kind)) {
    return std::nullopt;
  }
  return Group{kind, Attribute{attribute}, number & channel_mask};
}

}  // namespace

std::optional<Group> Group::decode(std::uint32_t number) {
  const std::uint32_t current = number | variables::new_group_bit;
  const GroupKind whole{current & ~channel_mask};
  if (is_com(whole)) {
    return Group{whole, Attribute::value, current & channel_mask};
  }
  return decode_internal(current);
}

namespace {

ads::Bytes text(std::string_view characters) {
  return ads::ByteWriter().text(characters).u8(0).take();
}

}  // namespace

ads::Bytes attribute_of(const Object& object, Attribute attribute) {
  switch (attribute) {
    case Attribute::name:
      return text(object.name);
    case Attribute::type:
      return text(object.type);
    case Attribute::length:
      return ads::ByteWriter().u32(object.length).take();
    case Attribute::unit:
      return text(object.unit);
    case Attribute::writable:
      return ads::ByteWriter().u8(object.write ? 1 : 0).take();
    case Attribute::value:
    case Attribute::address:
      break;
  }
  assert(false);
  return {};
}

}  // namespace millrace::cnc::simulator::objects
