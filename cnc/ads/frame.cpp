#include "cnc/ads/frame.hpp"

#include <algorithm>
#include <cassert>

#include <fmt/format.h>

namespace millrace::cnc::ads {
namespace {

/// Offset of the data length in an AMS header.
constexpr std::size_t data_length_offset = 20;

// Router frames carry 0 to 8 bytes. A longer frame of an unknown kind is not AMS/TCP.
constexpr std::size_t max_router_frame = 32;

Address read_address(ByteReader& in) {
  Address address;
  const auto net_id = in.take(address.net_id.bytes.size());
  std::ranges::copy(net_id, address.net_id.bytes.begin());
  address.port = in.u16();
  return address;
}

void write_address(ByteWriter& out, const Address& address) {
  out.bytes(address.net_id.bytes).u16(address.port);
}

tl::unexpected<ProtocolError> broken(std::string message) {
  return tl::make_unexpected(ProtocolError{std::move(message)});
}

/// True if the bytes, as many as an AMS header has, begin a frame of plain ADS: its two lengths
/// agree.
bool begins_with_ams_tcp(BytesView bytes) {
  ByteReader in(bytes);
  const auto kind = in.u16();
  const std::size_t length = in.u32();
  in.take(data_length_offset);
  return kind == 0 && in.ok() && length == packet_header_size + in.u32();
}

}  // namespace

void FrameReader::feed(BytesView bytes) {
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(consumed_));
  consumed_ = 0;
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

std::optional<FrameReader::Announced> FrameReader::announced() const {
  ByteReader in(BytesView(buffer_).subspan(consumed_));
  Announced frame;
  if (framing_ == Framing::ams_tcp) {
    frame.kind = FrameKind{in.u16()};
    frame.header = frame_header_size;
    frame.body = in.u32();
  } else {
    in.take(data_length_offset);
    frame.body = packet_header_size + in.u32();
    in.take(packet_header_size - data_length_offset - sizeof(std::uint32_t));
  }
  return in.ok() ? std::optional(frame) : std::nullopt;
}

tl::expected<std::optional<Frame>, ProtocolError> FrameReader::next() {
  const auto frame = announced();
  if (!frame) {
    return std::nullopt;
  }
  if (framing_ == Framing::headerless &&
      begins_with_ams_tcp(BytesView(buffer_).subspan(consumed_))) {
    return broken("a frame behind an AMS/TCP header; Secure ADS has none");
  }
  const auto kind = static_cast<std::uint16_t>(frame->kind);
  const std::size_t length = frame->body;
  if (length > max_frame_) {
    return broken(
        fmt::format("a frame announces {} bytes; at most {} are accepted", length, max_frame_));
  }
  if (kind == 0 && length < packet_header_size) {
    return broken(fmt::format("an ADS frame of {} bytes is too short for its AMS header", length));
  }
  if (kind != 0 && length >= max_router_frame) {
    return broken(fmt::format("not an AMS/TCP frame: kind {:#06x} with {} bytes", kind, length));
  }
  const auto bytes = BytesView(buffer_).subspan(consumed_ + frame->header);
  if (bytes.size() < length) {
    return std::nullopt;
  }
  consumed_ += frame->header + length;
  return Frame{frame->kind, bytes.first(length)};
}

tl::expected<Packet, ProtocolError> decode_packet(BytesView body) {
  ByteReader in(body);
  Packet packet;
  packet.header.target = read_address(in);
  packet.header.source = read_address(in);
  packet.header.command = Command{in.u16()};
  packet.header.flags = in.u16();
  const std::size_t data_length = in.u32();
  packet.header.error = from_wire(in.u32());
  packet.header.invoke_id = in.u32();
  if (!in.ok()) {
    return broken(fmt::format("{} bytes are too short for an AMS header", body.size()));
  }
  packet.data = in.rest();
  if (data_length != packet.data.size()) {
    return broken(fmt::format("the AMS header announces {} bytes of data, its frame holds {}",
                              data_length, packet.data.size()));
  }
  return packet;
}

Bytes encode_packet(const Header& header, BytesView data) {
  ByteWriter out;
  out.reserve(frame_header_size + packet_header_size + data.size());
  out.u16(0).u32(static_cast<std::uint32_t>(packet_header_size + data.size()));
  write_address(out, header.target);
  write_address(out, header.source);
  out.u16(static_cast<std::uint16_t>(header.command)).u16(header.flags);
  out.u32(static_cast<std::uint32_t>(data.size()));
  out.u32(static_cast<std::uint32_t>(header.error)).u32(header.invoke_id);
  out.bytes(data);
  return out.take();
}

Bytes encode_frame(FrameKind kind, BytesView body) {
  ByteWriter out;
  out.u16(static_cast<std::uint16_t>(kind))
      .u32(static_cast<std::uint32_t>(body.size()))
      .bytes(body);
  return out.take();
}

void append_frames(Bytes& output, BytesView frames, Framing framing) {
  if (framing == Framing::ams_tcp) {
    output.insert(output.end(), frames.begin(), frames.end());
    return;
  }
  ByteReader in(frames);
  while (!in.rest().empty()) {
    in.u16();
    const auto body = in.take(in.u32());
    assert(in.ok());
    output.insert(output.end(), body.begin(), body.end());
  }
}

Header response_header(const Header& request, ErrorCode error) {
  Header header = request;
  std::swap(header.target, header.source);
  header.flags = flags::ads_command | flags::response;
  header.error = error;
  return header;
}

}  // namespace millrace::cnc::ads
