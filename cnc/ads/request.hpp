// The payloads of ADS requests: a client encodes them, a server decodes them.
//
//   auto payload = encode(ReadWriteRequest{{0x122301, 0x48}, 256, name});
//   auto request = decode_request(packet.header.command, packet.data);
//   if (auto* read = request ? std::get_if<ReadRequest>(&*request) : nullptr) …
//
// Views point into the decoded payload. Sources: IB/tc3_ads_intro (documented).
#pragma once

#include <variant>
#include <vector>

#include "cnc/ads/device.hpp"
#include "cnc/ads/frame.hpp"

namespace millrace::cnc::ads {

struct InfoRequest {};
struct StateRequest {};

struct ReadRequest {
  Index index;
  /// The most bytes of the response; some clients send 0xFFFFFFFF.
  std::uint32_t length = 0;
};

struct WriteRequest {
  Index index;
  BytesView data;
};

struct WriteControlRequest {
  DeviceState wanted;
  BytesView data;
};

struct ReadWriteRequest {
  Index index;
  std::uint32_t read_length = 0;
  BytesView data;
};

/// When a notification is sent (ADSTRANSMODE).
enum class Transmission : std::uint32_t { cyclic = 3, on_change = 4 };

struct AddNotificationRequest {
  Index index;
  /// Bytes of the value in each sample.
  std::uint32_t length = 0;
  Transmission mode = Transmission::on_change;
  /// How long samples may be collected before they are sent, in 100 ns; 0 = at once.
  std::uint32_t max_delay = 0;
  /// The sample period, in 100 ns; 0 = every cycle of the task.
  std::uint32_t cycle = 0;
};

struct DeleteNotificationRequest {
  std::uint32_t handle = 0;
};

using Request =
    std::variant<InfoRequest, StateRequest, ReadRequest, WriteRequest, WriteControlRequest,
                 ReadWriteRequest, AddNotificationRequest, DeleteNotificationRequest>;

/// Fails with invalid_size for a payload whose lengths do not fit, and with service_not_supported
/// for a command that is not a request.
Result<Request> decode_request(Command command, BytesView payload);

Bytes encode(const ReadRequest& request);
Bytes encode(const WriteRequest& request);
Bytes encode(const ReadWriteRequest& request);
Bytes encode(const AddNotificationRequest& request);
Bytes encode(const DeleteNotificationRequest& request);
/// The items of a sum request that adds notifications.
Bytes encode(const std::vector<AddNotificationRequest>& requests);

/// Reads the 40 bytes of one AddDeviceNotification request, which sum requests contain too.
AddNotificationRequest parse_add_notification(ByteReader& in);

}  // namespace millrace::cnc::ads
