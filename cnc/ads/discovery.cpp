#include "cnc/ads/discovery.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace millrace::cnc::ads {
namespace {

constexpr std::uint32_t cookie = 0x71146603;
constexpr std::uint32_t response_bit = 0x80000000;
/// AMS port of the system service.
constexpr std::uint16_t system_service = 10000;
constexpr std::uint32_t most_tags = 100;

namespace tag {
constexpr std::uint16_t status = 1;
constexpr std::uint16_t password = 2;
constexpr std::uint16_t twincat_version = 3;
constexpr std::uint16_t system_version = 4;
constexpr std::uint16_t computer = 5;
constexpr std::uint16_t net_id = 7;
constexpr std::uint16_t options = 9;
constexpr std::uint16_t route_name = 12;
constexpr std::uint16_t user = 13;
constexpr std::uint16_t fingerprint = 18;
}  // namespace tag

constexpr std::uint32_t temporary_route = 1;

Bytes text(std::string_view content) {
  return ByteWriter().text(content).u8(0).take();
}

NetId read_net_id(BytesView bytes) {
  NetId id;
  std::ranges::copy(bytes.first(std::min(bytes.size(), id.bytes.size())), id.bytes.begin());
  return id;
}

BytesView bytes_of(const Datagram& datagram, std::uint16_t id) {
  const auto found =
      std::ranges::find(datagram.tags, id, [](const auto& tag) { return tag.first; });
  return found == datagram.tags.end() ? BytesView() : BytesView(found->second);
}

std::string text_of(const Datagram& datagram, std::uint16_t id) {
  const BytesView bytes = bytes_of(datagram, id);
  return {bytes.begin(), std::ranges::find(bytes, 0)};
}

std::string twincat_of(BytesView bytes) {
  ByteReader in(bytes);
  const int major = in.u8();
  const int minor = in.u8();
  const int build = in.u16();
  return in.ok() ? fmt::format("{}.{}.{}", major, minor, build) : "";
}

/// Reads a Windows structure (OSVERSIONINFO), which other systems send too.
std::string system_of(BytesView bytes) {
  ByteReader in(bytes);
  in.u32();
  const auto major = in.u32();
  const auto minor = in.u32();
  const auto build = in.u32();
  const auto platform = in.u32();
  if (!in.ok()) {
    return {};
  }
  const auto name = [platform] {
    switch (platform) {
      case 1:
        return "TC/RTOS";
      case 2:
        return "Windows NT";
      case 3:
        return "Windows CE";
      default:
        return "system";
    }
  };
  return fmt::format("{} {}.{}.{}", name(), major, minor, build);
}

Datagram answer_to(const Datagram& request, const Identity& identity) {
  return {request.invoke_id, request.service, true, {identity.net_id, system_service}};
}

}  // namespace

Bytes encode(const Datagram& datagram) {
  ByteWriter out;
  out.u32(cookie).u32(datagram.invoke_id);
  out.u32(static_cast<std::uint32_t>(datagram.service) | (datagram.is_response ? response_bit : 0));
  out.bytes(datagram.sender.net_id.bytes).u16(datagram.sender.port);
  out.u32(static_cast<std::uint32_t>(datagram.tags.size()));
  for (const auto& [id, data] : datagram.tags) {
    out.u16(id).u16(static_cast<std::uint16_t>(data.size())).bytes(data);
  }
  return out.take();
}

tl::expected<Datagram, ProtocolError> decode_datagram(BytesView bytes) {
  ByteReader in(bytes);
  const bool right = in.u32() == cookie;
  Datagram datagram;
  datagram.invoke_id = in.u32();
  const auto service = in.u32();
  datagram.service = DiscoveryService{service & ~response_bit};
  datagram.is_response = (service & response_bit) != 0;
  datagram.sender.net_id = read_net_id(in.take(datagram.sender.net_id.bytes.size()));
  datagram.sender.port = in.u16();
  const auto count = in.u32();
  for (std::uint32_t i = 0; i < std::min(count, most_tags) && in.ok(); ++i) {
    const auto id = in.u16();
    const BytesView data = in.take(in.u16());
    datagram.tags.emplace_back(id, Bytes(data.begin(), data.end()));
  }
  if (!right || !in.ok() || count > most_tags) {
    return tl::make_unexpected(ProtocolError{
        fmt::format("{} bytes that are not a message of an AMS router", bytes.size())});
  }
  return datagram;
}

Datagram identify_request(std::uint32_t invoke_id) {
  return {invoke_id, DiscoveryService::identify, false, {{}, system_service}};
}

Datagram identify_response(const Datagram& request, const Identity& identity) {
  Datagram answer = answer_to(request, identity);
  answer.tags.emplace_back(tag::computer, text(identity.name));
  answer.tags.emplace_back(tag::twincat_version, ByteWriter().u8(3).u8(1).u16(4024).take());
  if (!identity.fingerprint.empty()) {
    answer.tags.emplace_back(tag::fingerprint, text(identity.fingerprint));
  }
  return answer;
}

std::optional<Identity> identity_of(const Datagram& datagram) {
  if (!datagram.is_response || datagram.service != DiscoveryService::identify) {
    return std::nullopt;
  }
  return Identity{datagram.sender.net_id, text_of(datagram, tag::computer),
                  twincat_of(bytes_of(datagram, tag::twincat_version)),
                  system_of(bytes_of(datagram, tag::system_version)),
                  text_of(datagram, tag::fingerprint)};
}

Datagram encode(std::uint32_t invoke_id, const RouteRequest& route) {
  Datagram request{invoke_id, DiscoveryService::add_route, false, {route.net_id, system_service}};
  request.tags.emplace_back(tag::net_id,
                            Bytes(route.net_id.bytes.begin(), route.net_id.bytes.end()));
  request.tags.emplace_back(tag::user, text(route.user));
  request.tags.emplace_back(tag::password, text(route.password));
  request.tags.emplace_back(tag::computer, text(route.address));
  request.tags.emplace_back(tag::route_name, text(route.name));
  if (route.temporary) {
    request.tags.emplace_back(tag::options, ByteWriter().u32(temporary_route).take());
  }
  return request;
}

std::optional<RouteRequest> route_request_of(const Datagram& datagram) {
  if (datagram.is_response || datagram.service != DiscoveryService::add_route) {
    return std::nullopt;
  }
  return RouteRequest{read_net_id(bytes_of(datagram, tag::net_id)),
                      text_of(datagram, tag::route_name),
                      text_of(datagram, tag::computer),
                      text_of(datagram, tag::user),
                      text_of(datagram, tag::password),
                      (ByteReader(bytes_of(datagram, tag::options)).u32() & temporary_route) != 0};
}

Datagram route_response(const Datagram& request, const Identity& identity, ErrorCode status) {
  Datagram answer = answer_to(request, identity);
  answer.tags.emplace_back(tag::status,
                           ByteWriter().u32(static_cast<std::uint32_t>(status)).take());
  return answer;
}

std::optional<ErrorCode> route_status_of(const Datagram& datagram) {
  ByteReader in(bytes_of(datagram, tag::status));
  const auto status = in.u32();
  const bool right = datagram.is_response && datagram.service == DiscoveryService::add_route;
  return right && in.ok() ? std::optional(from_wire(status)) : std::nullopt;
}

}  // namespace millrace::cnc::ads
