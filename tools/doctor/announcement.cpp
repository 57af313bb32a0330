#include "tools/doctor/announcement.hpp"

#include <algorithm>
#include <bit>
#include <string_view>

namespace millrace::tools::doctor {

namespace {

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

/// Bounded reading from the front; after a read beyond the end ok() is false for good.
class Reader {
 public:
  Reader(std::span<const std::uint8_t> bytes, bool little) : rest_(bytes), little_(little) {}

  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::span<const std::uint8_t> take(std::size_t size) {
    if (size > rest_.size()) {
      ok_ = false;
      rest_ = {};
      return {};
    }
    const auto taken = rest_.first(size);
    rest_ = rest_.subspan(size);
    return taken;
  }
  /// Length, characters and a NUL, filled up to a multiple of four.
  std::string text() {
    const std::uint32_t length = u32();
    const auto bytes = take(length);
    constexpr std::uint32_t alignment = 4;
    take(std::min<std::size_t>((alignment - length % alignment) % alignment, rest_.size()));
    return {bytes.begin(), std::find(bytes.begin(), bytes.end(), std::uint8_t{0})};
  }
  [[nodiscard]] std::span<const std::uint8_t> rest() const { return rest_; }
  [[nodiscard]] bool ok() const { return ok_; }

 private:
  std::uint64_t number(std::size_t size) {
    const auto bytes = take(size);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      const std::size_t from = little_ ? bytes.size() - 1 - i : i;
      value = value << 8U | bytes[from];
    }
    return value;
  }

  std::span<const std::uint8_t> rest_;
  bool little_;
  bool ok_ = true;
};

void read_properties(Reader in, Announcement& found) {
  const std::uint32_t count = in.u32();
  for (std::uint32_t i = 0; i < count && in.ok(); ++i) {
    const std::string name = in.text();
    std::string value = in.text();
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
bool read_parameters(Reader& in, bool little, Announcement& found) {
  while (in.ok()) {
    const std::uint16_t id = in.u16();
    const std::uint16_t size = in.u16();
    if (id == pid_sentinel) {
      return in.ok();
    }
    const Reader value(in.take(size), little);
    if (id == pid_property_list) {
      read_properties(value, found);
    } else if (id == pid_entity_name) {
      found.name = Reader(value).text();
    } else if (id == pid_identity_token) {
      found.shows_certificate = true;
      Reader token(value);
      token.text();  // Its kind.
      read_properties(token, found);
    }
  }
  return false;
}

/// The content of a DATA submessage; false if it is not a participant's announcement.
bool read_data(std::span<const std::uint8_t> body, std::uint8_t flags, Announcement& found) {
  const bool little = (flags & little_endian) != 0;
  Reader in(body, little);
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
  if ((flags & has_inline_qos) != 0 && !read_parameters(in, little, ignored)) {
    return false;
  }
  const auto encapsulation = in.take(4);
  if (!in.ok() || encapsulation[0] != 0 ||
      (encapsulation[1] != pl_cdr_be && encapsulation[1] != pl_cdr_le)) {
    return false;
  }
  const bool payload_little = encapsulation[1] == pl_cdr_le;
  Reader payload(in.rest(), payload_little);
  return read_parameters(payload, payload_little, found);
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
    Reader length(rest.subspan(2, 2), (flags & little_endian) != 0);
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
