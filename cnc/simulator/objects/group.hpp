// The parts of an index group of the CNC.
//
//   auto group = Group::decode(0x122302);   // values of the decoder of channel 2
//
// Group = base of a kind + attribute + channel (IB/tf5200_ads_access_to_cnc/312767243, documented).
// Documentation of older controllers gives the same numbers without 0x100000
// (IB/hmiviaads/15685567371, documented); that both address the same objects is inferred.
#pragma once

#include <cstdint>
#include <optional>

#include "cnc/simulator/objects/object.hpp"
#include "cnc/variables/addresses.hpp"

namespace millrace::cnc::simulator::objects {

/// The kind of a group; the value is its base (documented).
enum class GroupKind : std::uint32_t {
  /// Commands and states of a channel, under the COM task.
  com_channel = 0x120100,
  /// Axes of the whole CNC, under the COM task.
  com_axis = 0x120200,
  /// The list of the COM objects (IB/tf5200_ads_access_to_cnc/855973643).
  com_directory = 0x130100,
  /// Axes of the whole CNC, under the GEO task.
  position_controller = 0x120300,
  interpolator = 0x121300,
  decoder = variables::decoder_group,
  /// State of the channel ("HLD").
  channel_state = 0x123300,
};

/// The attribute of an object; its value is the third digit from the right.
enum class Attribute : std::uint32_t {
  value = 0,
  name = 1,
  type = 2,
  length = 3,
  unit = 4,
  writable = 5,
  address = 6,
};

struct Group {
  GroupKind kind = GroupKind::decoder;
  Attribute attribute = Attribute::value;
  /// The channel's number in the group; 0 for an object of the whole CNC.
  std::uint32_t channel = 0;

  /// Nullopt for the number of an unknown kind.
  static std::optional<Group> decode(std::uint32_t number);
  /// The number of a group of values, with 0x100000.
  [[nodiscard]] std::uint32_t number() const { return static_cast<std::uint32_t>(kind) + channel; }
};

// The attributes of an object: name, type, length, unit, and whether it can be written
// (IB/tf5200_ads_access_to_cnc/312767243, documented).

/// Texts end with a NUL, the length is UNS32, writable is one byte (the kinds are documented, the
/// sizes are our choice). `attribute` is neither value nor address.
ads::Bytes attribute_of(const Object& object, Attribute attribute);

}  // namespace millrace::cnc::simulator::objects
