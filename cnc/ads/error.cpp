#include "cnc/ads/error.hpp"

#include <algorithm>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

namespace millrace::cnc::ads {
namespace {

struct Words {
  std::uint32_t code;
  std::string_view text;
};

constexpr std::uint32_t first_local_code = 0xFFFF0000;

// The names of Beckhoff's list of ADS return codes (IB/tc3_ads_intro/374277003.html, documented),
// in ascending order of the codes.
constexpr Words all_words[] = {
    {0x0, "no error"},
    {0x1, "internal error"},
    {0x2, "no real-time system"},
    {0x3, "allocation of locked memory failed"},
    {0x4, "mailbox full: the message could not be sent"},
    {0x5, "wrong receive handle"},
    {0x6, "target port not found: the task behind this AMS port is not running"},
    {0x7, "target machine not found: no AMS route"},
    {0x8, "unknown command id"},
    {0x9, "invalid task id"},
    {0xA, "no I/O"},
    {0xB, "unknown AMS command"},
    {0xC, "operating system error"},
    {0xD, "port not connected"},
    {0xE, "invalid AMS length"},
    {0xF, "invalid AMS NetId"},
    {0x10, "installation level too low"},
    {0x11, "no debugging available"},
    {0x12, "port disabled: the system service is not started"},
    {0x13, "port already connected"},
    {0x14, "AMS sync: operating system error"},
    {0x15, "AMS sync: timeout"},
    {0x16, "AMS sync: error"},
    {0x17, "AMS sync: no index map"},
    {0x18, "invalid AMS port"},
    {0x19, "no memory"},
    {0x1A, "TCP send error"},
    {0x1B, "host unreachable"},
    {0x1C, "invalid AMS fragment"},
    {0x1D, "TLS send error: the secure ADS connection failed"},
    {0x1E, "secure ADS access denied"},
    {0x500, "router: no locked memory left"},
    {0x501, "router: memory size cannot be changed"},
    {0x502, "router: mailbox full"},
    {0x503, "router: debug mailbox full"},
    {0x504, "router: unknown port type"},
    {0x505, "router: not initialised"},
    {0x506, "router: port number already in use"},
    {0x507, "router: port not registered"},
    {0x508, "router: no more ports"},
    {0x509, "router: invalid port"},
    {0x50A, "router: not active"},
    {0x50B, "router: mailbox full of fragments"},
    {0x50C, "router: fragment timeout"},
    {0x50D, "router: port removed"},
    {0x700, "device error"},
    {0x701, "service not supported"},
    {0x702, "invalid index group"},
    {0x703, "invalid index offset"},
    {0x704, "reading or writing not permitted"},
    {0x705, "size of the parameter is not correct"},
    {0x706, "invalid data"},
    {0x707, "device not ready"},
    {0x708, "device busy"},
    {0x709, "invalid context"},
    {0x70A, "insufficient memory in the device"},
    {0x70B, "invalid parameter"},
    {0x70C, "not found"},
    {0x70D, "syntax error"},
    {0x70E, "objects do not match"},
    {0x70F, "object already exists"},
    {0x710, "symbol not found"},
    {0x711, "symbol version invalid: the program was changed"},
    {0x712, "device in an invalid state"},
    {0x713, "transmission mode not supported"},
    {0x714, "notification handle invalid"},
    {0x715, "notification client unknown"},
    {0x716, "no more notification handles"},
    {0x717, "notification too large"},
    {0x718, "device not initialised"},
    {0x719, "device timeout"},
    {0x71A, "interface query failed"},
    {0x71B, "wrong interface requested"},
    {0x71C, "class id invalid"},
    {0x71D, "object id invalid"},
    {0x71E, "request pending"},
    {0x71F, "request aborted"},
    {0x720, "signal warning"},
    {0x721, "invalid array index"},
    {0x722, "symbol not active"},
    {0x723, "access denied"},
    {0x724, "license missing"},
    {0x725, "license expired"},
    {0x726, "license exceeded"},
    {0x727, "license invalid"},
    {0x728, "license for another system id"},
    {0x729, "license not limited in time"},
    {0x72A, "license issued in the future"},
    {0x72B, "license period too long"},
    {0x72C, "exception at system start"},
    {0x72D, "license file read twice"},
    {0x72E, "invalid signature"},
    {0x72F, "invalid certificate"},
    {0x730, "license: unknown public key"},
    {0x731, "license not valid for this system id"},
    {0x732, "demo license prohibited"},
    {0x733, "invalid function id"},
    {0x734, "outside the valid range"},
    {0x735, "invalid alignment"},
    {0x736, "invalid platform level"},
    {0x737, "context: forward to passive level"},
    {0x738, "context: forward to dispatch level"},
    {0x739, "context: forward to real time"},
    {0x740, "client error"},
    {0x741, "client: invalid parameter"},
    {0x742, "client: polling list is empty"},
    {0x743, "client: variable connection already in use"},
    {0x744, "client: invoke id already in use"},
    {0x745, "timeout: no answer in time"},
    {0x746, "client: operating system error"},
    {0x747, "client: invalid timeout value"},
    {0x748, "client: port not open"},
    {0x749, "client: no AMS address"},
    {0x750, "client: internal error in ADS sync"},
    {0x751, "client: hash table overflow"},
    {0x752, "client: hash key not found"},
    {0x753, "client: no more symbols in the cache"},
    {0x754, "client: invalid response"},
    {0x755, "client: sync port locked"},
    {0x756, "client: request cancelled"},
    {0x1000, "real-time system: internal error"},
    {0x1001, "real-time system: invalid timer value"},
    {0x1002, "real-time system: task pointer is zero"},
    {0x1003, "real-time system: stack pointer is zero"},
    {0x1004, "real-time system: task priority already in use"},
    {0x1005, "real-time system: no task control block left"},
    {0x1006, "real-time system: no semaphore left"},
    {0x1007, "real-time system: no queue space left"},
    {0x100D, "real-time system: external interrupt already applied"},
    {0x100E, "real-time system: external interrupt not applied"},
    {0x100F, "real-time system: applying the external interrupt failed"},
    {0x1010, "real-time system: called in the wrong context"},
    {0x1017, "real-time system: VT-x not supported"},
    {0x1018, "real-time system: VT-x not enabled"},
    {0x1019, "real-time system: function missing in VT-x"},
    {0x101A, "real-time system: enabling VT-x failed"},
    {0x274C, "TCP: connection timed out"},
    {0x274D, "TCP: connection refused"},
    {0x2751, "TCP: no route to the host"},
};
static_assert(std::ranges::is_sorted(all_words, {}, &Words::code));

std::string_view words_of_local(ErrorCode code) {
  switch (code) {
    case ErrorCode::link_lost:
      return "the connection to the controller closed while the request was pending";
    case ErrorCode::link_down:
      return "not connected to the controller";
    case ErrorCode::protocol_error:
      return "the answer breaks the ADS protocol";
    case ErrorCode::cancelled:
      return "request cancelled";
    default:
      return "unknown outcome";
  }
}

}  // namespace

std::string describe(ErrorCode code) {
  const auto number = static_cast<std::uint32_t>(code);
  if (number >= first_local_code) {
    return std::string(words_of_local(code));
  }
  const auto* const found = std::ranges::lower_bound(all_words, number, {}, &Words::code);
  if (found == std::end(all_words) || found->code != number) {
    return fmt::format("ADS error {:#x}", number);
  }
  return fmt::format("{:#x} {}", number, found->text);
}

ErrorCode from_wire(std::uint32_t code) {
  return code >= first_local_code ? ErrorCode::protocol_error : ErrorCode{code};
}

bool is_refusal(ErrorCode code) {
  switch (code) {
    case ErrorCode::service_not_supported:
    case ErrorCode::invalid_group:
    case ErrorCode::invalid_offset:
    case ErrorCode::access_denied_index:
    case ErrorCode::invalid_size:
    case ErrorCode::invalid_data:
    case ErrorCode::invalid_parameter:
    case ErrorCode::not_found:
    case ErrorCode::symbol_not_found:
    case ErrorCode::symbol_version_invalid:
    case ErrorCode::invalid_handle:
      return true;
    default:
      return false;
  }
}

bool leaves_outcome_unknown(ErrorCode code) {
  switch (code) {
    case ErrorCode::timeout:
    case ErrorCode::link_lost:
    case ErrorCode::cancelled:
    case ErrorCode::protocol_error:
    case ErrorCode::device_timeout:
    case ErrorCode::request_pending:
    case ErrorCode::request_aborted:
      return true;
    default:
      return false;
  }
}

bool is_undelivered(ErrorCode code) {
  const auto number = static_cast<std::uint32_t>(code);
  switch (number) {
    case 0x6:   // target port not found
    case 0x7:   // target machine not found
    case 0xD:   // port not connected
    case 0x12:  // port disabled
    case 0x1A:  // TCP send error
    case 0x1B:  // host unreachable
    case 0x1D:  // TLS send error
    case 0x1E:  // secure ADS access denied
      return true;
    default:
      return is_overload(code) || (number >= 0x500 && number <= 0x50D);  // errors of a router
  }
}

bool is_overload(ErrorCode code) {
  return code == ErrorCode::mailbox_full || code == ErrorCode::out_of_memory ||
         code == ErrorCode::router_out_of_memory || code == ErrorCode::router_mailbox_full;
}

}  // namespace millrace::cnc::ads
