// A datagram of LCM's UDP multicast, as liblcm 1.3 sends it (lcm_udpm.c): "LC02", a number, both 32
// bits of big endian, the channel's name, NUL, the message. Pure.
//
//   const auto packet = parse_packet(datagram);
//   if (packet) … packet->channel, packet->message
//
// What does not fit into one datagram goes in fragments ("LC03"); nothing of ours is that long.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace millrace::fabric::lcm {

/// Bytes of a channel's name (LCM_MAX_CHANNEL_NAME_LENGTH).
inline constexpr std::size_t longest_channel = 63;
/// Bytes of a message with its channel and the NUL that liblcm sends unfragmented
/// (LCM_SHORT_MESSAGE_MAX_SIZE).
inline constexpr std::size_t longest_packet = 65'499;

/// Points into the datagram.
struct Packet {
  std::uint32_t number = 0;
  std::string_view channel{};
  std::string_view message{};
};

enum class PacketFault : std::uint8_t {
  /// Another program's, or damaged: no LCM at all.
  foreign,
  /// A part of a long message.
  fragment
};

tl::expected<Packet, PacketFault> parse_packet(std::string_view datagram);

/// The channel of a long message, if `datagram` is its first part.
std::optional<std::string_view> channel_of_fragment(std::string_view datagram);

/// `channel` has at most longest_channel bytes and no NUL.
std::string format_packet(const Packet& packet);

}  // namespace millrace::fabric::lcm
