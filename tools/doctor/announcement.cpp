#include "tools/doctor/announcement.hpp"

#include <algorithm>
#include <bit>
#include <string_view>

#include "base/bytes.hpp"

namespace millrace::tools::doctor {

namespace {

using base::ByteReader;

constexpr std::size_t header_size = 20;
constexpr std::size_t prefix_at = 8;
constexpr std::uint8_t data_submessage = 0x15;
constexpr std::uint8_t little_endian = 0x01;
constexpr std::uint8_t has_inline_qos = 0x02;
constexpr std::uint8_t has_data = 0x04;
/// Entity id of the writer of participant data, as on the wire.
constexpr std::array<std::uint8_t, 4> spdp_writer{0x00, 0x01, 0x00, 0xc2};
/// Encapsulations of parameter lists; the second byte.
constexpr std::uint8_t pl_cdr_be = 0x02;
constexpr std::uint8_t pl_cdr_le = 0x03;
constexpr std::uint16_t pid_sentinel = 0x0001;
constexpr std::uint16_t pid_property_list = 0x0059;
constexpr std::uint16_t pid_entity_name = 0x0062;
constexpr std::uint16_t pid_identity_token = 0x1001;

/// Length, characters and a NUL, filled up to a multiple of four.
std::string take_text(ByteReader& in) {
  const std::uint32_t length = in.u32();
  const auto bytes = in.take(length);
  constexpr std::uint32_t alignment = 4;
  in.take(std::min<std::size_t>((alignment - length % alignment) % alignment, in.rest().size()));
  return std::string(base::text_in(bytes));
}

std::endian order_of(bool is_little) {
  return is_little ? std::endian::little : std::endian::big;
}

void read_properties(ByteReader in, Announcement& found) {
  const std::uint32_t count = in.u32();
  for (std::uint32_t i = 0; i < count && in.ok(); ++i) {
    const std::string name = take_text(in);
    std::string value = take_text(in);
    if (name == "__Hostname") {
      found.host = std::move(value);
    } else if (name == "__ProcessName") {
      found.process = std::move(value);
    } else if (name == "__Pid") {
      found.pid = std::move(value);
    } else if (name == "dds.cert.sn") {
      found.certificate = std::move(value);
    } else if (name == "dds.ca.sn") {
      found.authority = std::move(value);
    }
  }
}

/// Reads to the end of a parameter list; false if it has none.
bool read_parameters(ByteReader& in, std::endian order, Announcement& found) {
  while (in.ok()) {
    const std::uint16_t id = in.u16();
    const std::uint16_t size = in.u16();
    if (id == pid_sentinel) {
      return in.ok();
    }
    ByteReader value(in.take(size), order);
    if (id == pid_property_list) {
      read_properties(value, found);
    } else if (id == pid_entity_name) {
      found.name = take_text(value);
    } else if (id == pid_identity_token) {
      found.shows_certificate = true;
      take_text(value);  // The kind of the token.
      read_properties(value, found);
    }
  }
  return false;
}

/// The content of a DATA submessage; false if it is not a participant's announcement.
bool read_data(std::span<const std::uint8_t> body, std::uint8_t flags, Announcement& found) {
  const std::endian order = order_of((flags & little_endian) != 0);
  ByteReader in(body, order);
  in.u16();
  const std::uint16_t to_inline_qos = in.u16();
  in.take(4);
  const auto writer = in.take(spdp_writer.size());
  constexpr std::uint16_t ids_and_number = 16;
  if (!in.ok() || !std::ranges::equal(writer, spdp_writer) || to_inline_qos < ids_and_number ||
      (flags & has_data) == 0) {
    return false;
  }
  in.take(to_inline_qos - 8U);  // The rest of it after the two ids.
  Announcement ignored;
  if ((flags & has_inline_qos) != 0 && !read_parameters(in, order, ignored)) {
    return false;
  }
  const auto encapsulation = in.take(4);
  if (!in.ok() || encapsulation[0] != 0 ||
      (encapsulation[1] != pl_cdr_be && encapsulation[1] != pl_cdr_le)) {
    return false;
  }
  const std::endian payload_order = order_of(encapsulation[1] == pl_cdr_le);
  ByteReader payload(in.rest(), payload_order);
  return read_parameters(payload, payload_order, found);
}

}  // namespace

std::optional<Announcement> parse_announcement(std::span<const std::uint8_t> packet) {
  constexpr std::string_view magic = "RTPS";
  if (packet.size() < header_size || !std::equal(magic.begin(), magic.end(), packet.begin())) {
    return std::nullopt;
  }
  Announcement found;
  std::copy_n(packet.begin() + prefix_at, found.prefix.size(), found.prefix.begin());
  auto rest = packet.subspan(header_size);
  constexpr std::size_t submessage_header = 4;
  while (rest.size() >= submessage_header) {
    const std::uint8_t id = rest[0];
    const std::uint8_t flags = rest[1];
    ByteReader length(rest.subspan(2, 2), order_of((flags & little_endian) != 0));
    const std::uint16_t announced = length.u16();
    rest = rest.subspan(submessage_header);
    // Zero in the last one: up to the end of the packet.
    const std::size_t size = announced == 0 && id == data_submessage ? rest.size() : announced;
    if (size > rest.size()) {
      return std::nullopt;
    }
    if (id == data_submessage && read_data(rest.first(size), flags, found)) {
      return found;
    }
    rest = rest.subspan(size);
  }
  return std::nullopt;
}

}  // namespace millrace::tools::doctor
