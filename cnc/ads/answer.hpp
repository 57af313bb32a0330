// The response of a Device to one ADS request; notifications are no matter of the device.
#pragma once

#include "cnc/ads/device.hpp"
#include "cnc/ads/frame.hpp"

namespace millrace::cnc::ads {

/// The payload of the response. A payload that does not fit its command is answered with
/// invalid_size, a command the device does not have with service_not_supported; both in the form of
/// that command's response, so that no client waits for more bytes.
Bytes answer(Device& device, std::uint16_t port, Command command, BytesView payload);

}  // namespace millrace::cnc::ads
