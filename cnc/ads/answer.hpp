// The response of a Device to one ADS request. Notification requests are handled elsewhere
// (notification_answer.hpp).
#pragma once

#include "cnc/ads/device.hpp"
#include "cnc/ads/frame.hpp"

namespace millrace::cnc::ads {

/// Returns the payload of the response. A payload that does not fit its command gets invalid_size;
/// an unsupported command gets service_not_supported. Both errors have the form of that command's
/// response, so that no client waits for more bytes.
Bytes answer(Device& device, std::uint16_t port, Command command, BytesView payload);

}  // namespace millrace::cnc::ads
