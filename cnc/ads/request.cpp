#include "cnc/ads/request.hpp"

namespace millrace::cnc::ads {
namespace {

constexpr std::size_t add_notification_reserve = 16;

Index parse_index(ByteReader& in) {
  const auto group = in.u32();
  const auto offset = in.u32();
  return {group, offset};
}

ByteWriter& write_index(ByteWriter& out, Index index) {
  return out.u32(index.group).u32(index.offset);
}

std::uint32_t size_of(BytesView data) {
  return static_cast<std::uint32_t>(data.size());
}

ReadRequest parse_read(ByteReader& in) {
  const auto index = parse_index(in);
  return {index, in.u32()};
}

WriteRequest parse_write(ByteReader& in) {
  const auto index = parse_index(in);
  const auto length = in.u32();
  return {index, in.take(length)};
}

WriteControlRequest parse_write_control(ByteReader& in) {
  DeviceState wanted;
  wanted.ads = in.u16();
  wanted.device = in.u16();
  const auto length = in.u32();
  return {wanted, in.take(length)};
}

ReadWriteRequest parse_read_write(ByteReader& in) {
  const auto index = parse_index(in);
  const auto read_length = in.u32();
  const auto write_length = in.u32();
  return {index, read_length, in.take(write_length)};
}

}  // namespace

AddNotificationRequest parse_add_notification(ByteReader& in) {
  AddNotificationRequest request;
  request.index = parse_index(in);
  request.length = in.u32();
  request.mode = Transmission{in.u32()};
  request.max_delay = in.u32();
  request.cycle = in.u32();
  in.take(add_notification_reserve);
  return request;
}

Result<Request> decode_request(Command command, BytesView payload) {
  ByteReader in(payload);
  Request request;
  switch (command) {
    case Command::read_device_info:
      request = InfoRequest{};
      break;
    case Command::read_state:
      request = StateRequest{};
      break;
    case Command::read:
      request = parse_read(in);
      break;
    case Command::write:
      request = parse_write(in);
      break;
    case Command::write_control:
      request = parse_write_control(in);
      break;
    case Command::read_write:
      request = parse_read_write(in);
      break;
    case Command::add_notification:
      request = parse_add_notification(in);
      break;
    case Command::delete_notification:
      request = DeleteNotificationRequest{in.u32()};
      break;
    default:
      return tl::make_unexpected(ErrorCode::service_not_supported);
  }
  if (!in.exact()) {
    return tl::make_unexpected(ErrorCode::invalid_size);
  }
  return request;
}

Bytes encode(const ReadRequest& request) {
  ByteWriter out;
  return write_index(out, request.index).u32(request.length).take();
}

Bytes encode(const WriteRequest& request) {
  ByteWriter out;
  return write_index(out, request.index).u32(size_of(request.data)).bytes(request.data).take();
}

Bytes encode(const ReadWriteRequest& request) {
  ByteWriter out;
  write_index(out, request.index).u32(request.read_length).u32(size_of(request.data));
  return out.bytes(request.data).take();
}

Bytes encode(const AddNotificationRequest& request) {
  ByteWriter out;
  write_index(out, request.index).u32(request.length).u32(static_cast<std::uint32_t>(request.mode));
  return out.u32(request.max_delay).u32(request.cycle).zeros(add_notification_reserve).take();
}

Bytes encode(const std::vector<AddNotificationRequest>& requests) {
  ByteWriter out;
  for (const AddNotificationRequest& request : requests) {
    out.bytes(encode(request));
  }
  return out.take();
}

Bytes encode(const DeleteNotificationRequest& request) {
  ByteWriter out;
  return out.u32(request.handle).take();
}

}  // namespace millrace::cnc::ads
