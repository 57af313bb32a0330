// The payloads of ADS responses: a server encodes them, a client decodes them.
//
//   auto bytes = encode_data(device.read(port, index, length));
//   auto value = decode_data(packet.data, length);          // never more than requested
//
// Decoding trusts no length of the peer: one that disagrees with the bytes present is a
// protocol_error. A response with less data than requested is valid. Sources: IB/tc3_ads_intro
// (documented).
#pragma once

#include <vector>

#include "cnc/ads/device.hpp"

namespace millrace::cnc::ads {

/// Write, WriteControl, DeleteDeviceNotification: the result only.
Bytes encode_result(const Result<void>& result);
Result<void> decode_result(BytesView payload);

/// Read, ReadWrite. An error is sent as 8 bytes (Beckhoff's AdsLib waits for them); the decoder
/// accepts one of 4 bytes, as some TwinCAT 2 devices send it.
Bytes encode_data(const Result<Bytes>& data);
/// The view is into `payload`. More data than `asked` bytes is a protocol_error.
Result<BytesView> decode_data(BytesView payload, std::uint32_t asked);

/// The name is sent with 16 bytes: longer ones are truncated.
Bytes encode_info(const Result<DeviceInfo>& info);
Result<DeviceInfo> decode_info(BytesView payload);

Bytes encode_state(const Result<DeviceState>& state);
Result<DeviceState> decode_state(BytesView payload);

/// AddDeviceNotification.
Bytes encode_handle(const Result<std::uint32_t>& handle);
Result<std::uint32_t> decode_handle(BytesView payload);

/// The response to a sum request that adds `count` notifications: result and handle of each.
Result<std::vector<Result<std::uint32_t>>> decode_handles(BytesView answer, std::size_t count);

/// The value of one notification at one time.
struct Sample {
  std::uint32_t handle = 0;
  BytesView data;
};
/// The samples of one time.
struct Stamp {
  /// 100 ns since 1601-01-01 UTC (FILETIME).
  std::uint64_t time = 0;
  std::vector<Sample> samples;
};
/// DeviceNotification, which the server sends without a request.
Bytes encode_notification(const std::vector<Stamp>& stamps);
/// The samples are views into `payload`.
Result<std::vector<Stamp>> decode_notification(BytesView payload);

}  // namespace millrace::cnc::ads
