// TlsConnectInfo: the message that each side of a Secure ADS connection sends once, inside TLS and
// before the first frame. The client sends a request, the controller responds with 64 bytes. Pure.
//
//   const Bytes hello = encode(ConnectInfo{.flags = connect_flags::self_signed, .net_id = ours});
//   const auto answer = decode_connect_info(received);
//   if (answer->error != ConnectError::none) …          // the controller closes the connection
//
// Beckhoff does not document it; layout and numbers are those of kevinherron/beckhoff-secure-ads
// (inferred, https://github.com/kevinherron/beckhoff-secure-ads).
#pragma once

#include <cstdint>
#include <string>

#include <tl/expected.hpp>

#include "cnc/ads/address.hpp"
#include "cnc/ads/bytes.hpp"
#include "cnc/ads/frame.hpp"

namespace millrace::cnc::ads {

inline constexpr std::size_t connect_info_size = 64;
/// In bytes, with user name and password.
inline constexpr std::size_t max_connect_info_size = 512;

namespace connect_flags {
/// Set in each response.
inline constexpr std::uint16_t response = 0x01;
/// In a response: frames may follow. Some controllers accept frames without setting it.
inline constexpr std::uint16_t ams_allowed = 0x02;
/// The client has a self-signed certificate, identified by its fingerprint.
inline constexpr std::uint16_t self_signed = 0x10;
/// The route leads to the client's IP address, not to its host name.
inline constexpr std::uint16_t ip_address = 0x20;
/// The common name of the certificate need not be the host's.
inline constexpr std::uint16_t ignore_common_name = 0x40;
/// Asks the controller to store a route to the client, and its fingerprint.
inline constexpr std::uint16_t add_route = 0x80;
}  // namespace connect_flags

/// Why a controller refuses a client.
enum class ConnectError : std::uint8_t {
  none = 0,
  version = 1,
  common_name = 2,
  unknown_certificate = 3,
  unknown_user = 4,
};

/// All texts are in CP1252.
struct ConnectInfo {
  std::uint16_t flags = 0;
  std::uint8_t version = 1;
  ConnectError error = ConnectError::none;
  /// NetId of the sender.
  NetId net_id{};
  /// Host name of the sender; at most 32 bytes are sent.
  std::string host{};
  /// Both or neither, together at most 448 bytes and each at most 255.
  std::string user{};
  std::string password{};
  bool operator==(const ConnectInfo&) const = default;
};

Bytes encode(const ConnectInfo& info);

/// The length of the whole message, from its first 64 bytes. Fails if they announce an impossible
/// length.
tl::expected<std::size_t, ProtocolError> connect_info_length(BytesView head);
/// Decodes a message of exactly that length.
tl::expected<ConnectInfo, ProtocolError> decode_connect_info(BytesView bytes);

/// For example "error 3, unknown certificate".
std::string describe(ConnectError error);

}  // namespace millrace::cnc::ads
