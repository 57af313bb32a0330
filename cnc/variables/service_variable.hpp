// The five variables of a channel's Service Interface (IB/tf5200_service_interface/356533387.html,
// documented): their names and types.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "cnc/ads/device.hpp"

namespace millrace::cnc::variables {

enum class ServiceVariable : std::uint8_t {
  uuid,
  request,
  request_state,
  response_state,
  response
};

inline constexpr std::array all_service_variables{
    ServiceVariable::uuid, ServiceVariable::request, ServiceVariable::request_state,
    ServiceVariable::response_state, ServiceVariable::response};

/// For example "V.G.SERVICE.REQUEST_STATE".
constexpr std::string_view name_of(ServiceVariable variable) {
  switch (variable) {
    case ServiceVariable::uuid:
      return "V.G.SERVICE.UUID";
    case ServiceVariable::request:
      return "V.G.SERVICE.REQUEST";
    case ServiceVariable::request_state:
      return "V.G.SERVICE.REQUEST_STATE";
    case ServiceVariable::response_state:
      return "V.G.SERVICE.RESPONSE_STATE";
    case ServiceVariable::response:
      return "V.G.SERVICE.RESPONSE";
  }
  return {};
}

/// The states are UNS32 (inferred), the others strings of 127 bytes (documented for REQUEST and
/// RESPONSE).
constexpr bool is_state(ServiceVariable variable) {
  return variable == ServiceVariable::request_state || variable == ServiceVariable::response_state;
}

/// A state, or a text as bytes in CP1252 without the NUL.
using ServiceValue = std::variant<std::uint32_t, std::string>;

// Encodes and decodes the bytes of the Service Interface's variables. Pure.

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
