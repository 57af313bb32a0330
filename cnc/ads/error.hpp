// ADS and AMS error codes with their descriptions, and the client's own error codes.
//
//   if (!answer) log->warn("read failed: {}", describe(answer.error()));
//   → read failed: 0x710 symbol not found
#pragma once

#include <cstdint>
#include <string>

namespace millrace::cnc::ads {

/// Codes as they are sent on the wire, and local ones (above 0xFFFF0000), which are never sent.
enum class ErrorCode : std::uint32_t {
  none = 0,
  mailbox_full = 4,
  target_port_not_found = 6,
  target_machine_not_found = 7,
  out_of_memory = 0x19,
  router_out_of_memory = 0x500,
  router_mailbox_full = 0x502,
  service_not_supported = 0x701,
  invalid_group = 0x702,
  invalid_offset = 0x703,
  access_denied_index = 0x704,
  invalid_size = 0x705,
  invalid_data = 0x706,
  not_ready = 0x707,
  busy = 0x708,
  invalid_parameter = 0x70B,
  not_found = 0x70C,
  symbol_not_found = 0x710,
  symbol_version_invalid = 0x711,
  invalid_state = 0x712,
  transmission_not_supported = 0x713,
  invalid_handle = 0x714,
  client_unknown = 0x715,
  no_more_handles = 0x716,
  device_timeout = 0x719,
  request_pending = 0x71E,
  request_aborted = 0x71F,
  access_denied = 0x723,
  timeout = 0x745,

  /// The connection closed while the request was pending: whether a write took place is unknown.
  link_lost = 0xFFFF0001,
  /// The connection is down; no request was sent.
  link_down = 0xFFFF0002,
  /// The response violates the protocol (lengths that disagree, more data than requested).
  protocol_error = 0xFFFF0003,
  /// The caller cancelled the request; whether a write took place is unknown.
  cancelled = 0xFFFF0004,
};

/// For example "0x710 symbol not found". For a code without a name, its number.
std::string describe(ErrorCode code);

/// Converts a code read from a frame. The numbers of our local codes become protocol_error.
ErrorCode from_wire(std::uint32_t code);

/// The controller refuses the request permanently: a wrong address, name, handle, size or value.
/// The request has changed nothing.
bool is_refusal(ErrorCode code);

/// It is unknown whether a write with this error took place: there was no response, or an
/// ambiguous one.
bool leaves_outcome_unknown(ErrorCode code);

/// As the error of an AMS header: a router could not deliver the request, so the response does not
/// prove that the controller runs. Device errors (0x7xx) come from behind the router.
bool is_undelivered(ErrorCode code);

/// The controller is overloaded (mailbox or router memory full): send fewer requests at once.
bool is_overload(ErrorCode code);

}  // namespace millrace::cnc::ads
