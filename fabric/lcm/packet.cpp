#include "fabric/lcm/packet.hpp"

#include <boost/endian/conversion.hpp>

namespace millrace::fabric::lcm {

namespace {

constexpr std::uint32_t whole_magic = 0x4C433032;     // "LC02"
constexpr std::uint32_t fragment_magic = 0x4C433033;  // "LC03"
constexpr std::size_t header_size = 8;

std::uint32_t number_at(std::string_view bytes, std::size_t offset) {
  return boost::endian::load_big_u32(
      reinterpret_cast<const unsigned char*>(bytes.substr(offset).data()));
}

void append(std::string& bytes, std::uint32_t number) {
  unsigned char big[sizeof number];
  boost::endian::store_big_u32(big, number);
  bytes.append(reinterpret_cast<const char*>(big), sizeof big);
}

}  // namespace

tl::expected<Packet, PacketFault> parse_packet(std::string_view datagram) {
  if (datagram.size() < header_size) {
    return tl::unexpected(PacketFault::foreign);
  }
  const std::uint32_t magic = number_at(datagram, 0);
  if (magic == fragment_magic) {
    return tl::unexpected(PacketFault::fragment);
  }
  const std::string_view rest = datagram.substr(header_size);
  const std::size_t end = rest.find('\0');
  if (magic != whole_magic || end > longest_channel) {
    return tl::unexpected(PacketFault::foreign);
  }
  return Packet{.number = number_at(datagram, 4),
                .channel = rest.substr(0, end),
                .message = rest.substr(end + 1)};
}

std::optional<std::string_view> channel_of_fragment(std::string_view datagram) {
  // Magic, number, size, offset, the part's number and how many there are.
  constexpr std::size_t part_at = 16;
  constexpr std::size_t fragment_header_size = 20;
  if (datagram.size() < fragment_header_size || number_at(datagram, 0) != fragment_magic ||
      number_at(datagram, part_at) >> 16U != 0) {
    return std::nullopt;
  }
  const std::string_view rest = datagram.substr(fragment_header_size);
  const std::size_t end = rest.find('\0');
  // Beyond it also if there is no NUL.
  return end > longest_channel ? std::nullopt : std::optional(rest.substr(0, end));
}

std::string format_packet(const Packet& packet) {
  std::string datagram;
  datagram.reserve(header_size + packet.channel.size() + 1 + packet.message.size());
  append(datagram, whole_magic);
  append(datagram, packet.number);
  datagram.append(packet.channel);
  datagram.push_back('\0');
  datagram.append(packet.message);
  return datagram;
}

}  // namespace millrace::fabric::lcm
