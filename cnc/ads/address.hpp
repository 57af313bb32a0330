// AMS addresses: the source and the target of an ADS request.
//
//   auto id = NetId::parse("127.0.0.1.1.1");     // 6 numbers of 0..255
//   Address sda{*id, 552};
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace millrace::cnc::ads {

/// An AMS NetId: six free bytes. By convention these are an IPv4 address and ".1.1"; it is not an
/// IP address.
struct NetId {
  std::array<std::uint8_t, 6> bytes{};

  /// Parses "a.b.c.d.e.f", each 0..255; nullopt for any other text.
  static std::optional<NetId> parse(std::string_view text);
  [[nodiscard]] std::string to_string() const;
  auto operator<=>(const NetId&) const = default;
};

/// NetId and AMS port. A CNC answers on 551 (GEO), 552 (SDA) and 553 (COM).
struct Address {
  NetId net_id;
  std::uint16_t port = 0;
  auto operator<=>(const Address&) const = default;
};

/// The address of a value within one AMS port.
struct Index {
  std::uint32_t group = 0;
  std::uint32_t offset = 0;
  auto operator<=>(const Index&) const = default;
};

}  // namespace millrace::cnc::ads
