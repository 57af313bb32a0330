#include "cnc/ads/connect_info.hpp"

#include <algorithm>
#include <cassert>

#include <fmt/format.h>

namespace millrace::cnc::ads {
namespace {

constexpr std::size_t reserved_size = 18;
constexpr std::size_t host_size = 32;
constexpr std::size_t longest_text = 255;

tl::unexpected<ProtocolError> wrong_info(std::string message) {
  return tl::make_unexpected(ProtocolError{std::move(message)});
}

std::string text_of(BytesView bytes) {
  return {bytes.begin(), bytes.end()};
}

}  // namespace

Bytes encode(const ConnectInfo& info) {
  assert(info.user.size() <= longest_text && info.password.size() <= longest_text);
  const std::size_t size = connect_info_size + info.user.size() + info.password.size();
  assert(size <= max_connect_info_size);
  const auto host = std::string_view(info.host).substr(0, host_size);
  return ByteWriter()
      .u16(static_cast<std::uint16_t>(size))
      .u16(info.flags)
      .u8(info.version)
      .u8(static_cast<std::uint8_t>(info.error))
      .bytes(info.net_id.bytes)
      .u8(static_cast<std::uint8_t>(info.user.size()))
      .u8(static_cast<std::uint8_t>(info.password.size()))
      .zeros(reserved_size)
      .text(host)
      .zeros(host_size - host.size())
      .text(info.user)
      .text(info.password)
      .take();
}

tl::expected<std::size_t, ProtocolError> connect_info_length(BytesView head) {
  ByteReader in(head);
  const std::size_t size = in.u16();
  if (!in.ok() || size < connect_info_size || size > max_connect_info_size) {
    return wrong_info(fmt::format("a TlsConnectInfo of {} bytes; expected {} to {}", size,
                                  connect_info_size, max_connect_info_size));
  }
  return size;
}

tl::expected<ConnectInfo, ProtocolError> decode_connect_info(BytesView bytes) {
  const auto size = connect_info_length(bytes);
  if (!size) {
    return tl::make_unexpected(size.error());
  }
  ByteReader in(bytes);
  in.u16();
  ConnectInfo info;
  info.flags = in.u16();
  info.version = in.u8();
  info.error = ConnectError{in.u8()};
  std::ranges::copy(in.take(info.net_id.bytes.size()), info.net_id.bytes.begin());
  const std::size_t user = in.u8();
  const std::size_t password = in.u8();
  in.take(reserved_size);
  info.host = text_of(in.take(host_size));
  info.host.resize(std::min(info.host.find('\0'), info.host.size()));
  info.user = text_of(in.take(user));
  info.password = text_of(in.take(password));
  if (!in.exact() || bytes.size() != *size) {
    return wrong_info(fmt::format("a TlsConnectInfo says {} bytes, {} of them texts, and has {}",
                                  *size, user + password, bytes.size()));
  }
  return info;
}

std::string describe(ConnectError error) {
  const auto name = [error] {
    switch (error) {
      case ConnectError::none:
        return "none";
      case ConnectError::version:
        return "unknown version";
      case ConnectError::common_name:
        return "common name does not match";
      case ConnectError::unknown_certificate:
        return "unknown certificate";
      case ConnectError::unknown_user:
        return "unknown user";
    }
    return "unknown";
  };
  return fmt::format("error {}, {}", static_cast<int>(error), name());
}

}  // namespace millrace::cnc::ads
