// Encodes and decodes the bytes of the Service Interface's variables. Pure.
#pragma once

#include "cnc/ads/device.hpp"
#include "cnc/variables/service_variable.hpp"

namespace millrace::cnc::variables {

/// How many bytes to request: texts may be padded to their full size, which is documented only for
/// REQUEST and RESPONSE (128).
constexpr std::uint32_t read_length(ServiceVariable variable) {
  constexpr std::uint32_t state_size = 4;
  constexpr std::uint32_t longest_text = 256;
  return is_state(variable) ? state_size : longest_text;
}

/// A state that does not have 4 bytes is a protocol_error.
ads::Result<ServiceValue> decode_value(ServiceVariable variable, ads::BytesView bytes);

/// A text that does not fit fails with invalid_size. The value must be of the variable's kind.
ads::Result<ads::Bytes> encode_value(ServiceVariable variable, const ServiceValue& value);

}  // namespace millrace::cnc::variables
