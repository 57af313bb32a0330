#include "cnc/ads/response.hpp"

#include <utility>

namespace millrace::cnc::ads {
namespace {

constexpr std::size_t info_name_size = 16;

ByteWriter& write_code(ByteWriter& out, ErrorCode code) {
  return out.u32(static_cast<std::uint32_t>(code));
}

Bytes encode_error(ErrorCode code) {
  ByteWriter out;
  return write_code(out, code).take();
}

tl::unexpected<ErrorCode> protocol_error() {
  return tl::make_unexpected(ErrorCode::protocol_error);
}

// Reads the result in front of every response; fails with its error code if it has one.
Result<ByteReader> open(BytesView payload) {
  ByteReader in(payload);
  const auto code = from_wire(in.u32());
  if (!in.ok()) {
    return protocol_error();
  }
  if (code != ErrorCode::none) {
    return tl::make_unexpected(code);
  }
  return in;
}

// What `decode` reads behind the result; protocol_error if bytes are missing.
template <typename Decode>
auto decode_rest(BytesView payload, Decode decode)
    -> Result<decltype(decode(std::declval<ByteReader&>()))> {
  auto in = open(payload);
  if (!in) {
    return tl::make_unexpected(in.error());
  }
  auto decoded = decode(*in);
  if (!in->ok()) {
    return protocol_error();
  }
  return decoded;
}

}  // namespace

Bytes encode_result(const Result<void>& result) {
  return encode_error(result ? ErrorCode::none : result.error());
}

Result<void> decode_result(BytesView payload) {
  return open(payload).map([](const ByteReader&) {});
}

Bytes encode_data(const Result<Bytes>& data) {
  ByteWriter out;
  if (!data) {
    return write_code(out, data.error()).u32(0).take();
  }
  out.reserve(8 + data->size());
  write_code(out, ErrorCode::none).u32(static_cast<std::uint32_t>(data->size()));
  return out.bytes(*data).take();
}

Result<BytesView> decode_data(BytesView payload, std::uint32_t asked) {
  auto in = open(payload);
  if (!in) {
    return tl::make_unexpected(in.error());
  }
  const auto length = in->u32();
  const auto data = in->take(length);
  if (!in->ok() || length > asked) {
    return protocol_error();
  }
  return data;
}

Bytes encode_info(const Result<DeviceInfo>& info) {
  if (!info) {
    return encode_error(info.error());
  }
  ByteWriter out;
  write_code(out, ErrorCode::none).u8(info->major).u8(info->minor).u16(info->build);
  const auto name = std::string_view(info->name).substr(0, info_name_size);
  return out.text(name).zeros(info_name_size - name.size()).take();
}

Result<DeviceInfo> decode_info(BytesView payload) {
  return decode_rest(payload, [](ByteReader& in) {
    DeviceInfo info;
    info.major = in.u8();
    info.minor = in.u8();
    info.build = in.u16();
    info.name = text_in(in.take(info_name_size));
    return info;
  });
}

Bytes encode_state(const Result<DeviceState>& state) {
  if (!state) {
    return encode_error(state.error());
  }
  ByteWriter out;
  return write_code(out, ErrorCode::none).u16(state->ads).u16(state->device).take();
}

Result<DeviceState> decode_state(BytesView payload) {
  return decode_rest(payload, [](ByteReader& in) {
    DeviceState state;
    state.ads = in.u16();
    state.device = in.u16();
    return state;
  });
}

Bytes encode_handle(const Result<std::uint32_t>& handle) {
  if (!handle) {
    return encode_error(handle.error());
  }
  ByteWriter out;
  return write_code(out, ErrorCode::none).u32(*handle).take();
}

Result<std::uint32_t> decode_handle(BytesView payload) {
  return decode_rest(payload, [](ByteReader& in) { return in.u32(); });
}

Bytes encode_notification(const std::vector<Stamp>& stamps) {
  ByteWriter inner;
  inner.u32(static_cast<std::uint32_t>(stamps.size()));
  for (const auto& stamp : stamps) {
    inner.u64(stamp.time).u32(static_cast<std::uint32_t>(stamp.samples.size()));
    for (const auto& sample : stamp.samples) {
      inner.u32(sample.handle)
          .u32(static_cast<std::uint32_t>(sample.data.size()))
          .bytes(sample.data);
    }
  }
  ByteWriter out;
  return out.u32(static_cast<std::uint32_t>(inner.size())).bytes(inner.take()).take();
}

Result<std::vector<Result<std::uint32_t>>> decode_handles(BytesView answer, std::size_t count) {
  ByteReader in(answer);
  std::vector<Result<std::uint32_t>> handles;
  for (std::size_t i = 0; i < count && in.ok(); ++i) {
    const auto code = from_wire(in.u32());
    const auto handle = in.u32();
    handles.push_back(code == ErrorCode::none ? Result<std::uint32_t>(handle)
                                              : tl::make_unexpected(code));
  }
  if (!in.exact()) {
    return protocol_error();
  }
  return handles;
}

Result<std::vector<Stamp>> decode_notification(BytesView payload) {
  ByteReader outer(payload);
  const auto length = outer.u32();
  ByteReader in(outer.take(length));
  std::vector<Stamp> stamps;
  const auto stamp_count = in.u32();
  for (std::uint32_t s = 0; s < stamp_count && in.ok(); ++s) {
    Stamp stamp{in.u64(), {}};
    const auto sample_count = in.u32();
    for (std::uint32_t i = 0; i < sample_count && in.ok(); ++i) {
      const auto handle = in.u32();
      const auto size = in.u32();
      stamp.samples.push_back({handle, in.take(size)});
    }
    stamps.push_back(std::move(stamp));
  }
  if (!outer.ok() || !in.ok()) {
    return protocol_error();
  }
  return stamps;
}

}  // namespace millrace::cnc::ads
