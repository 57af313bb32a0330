// How the two ends of a Secure ADS connection know each other.
#pragma once

#include <cstdint>
#include <string>
#include <variant>

namespace millrace::cnc::ads {

/// TCP port of Secure ADS (documented, IB/tc3_grundlagen "Secure ADS").
inline constexpr std::uint16_t secure_port = 8016;

/// A pre-shared key: TwinCAT makes one of an identity, in which capitals do not count, and a
/// password.
struct Psk {
  std::string identity;
  std::string password;
  bool operator==(const Psk&) const = default;
};

/// What a client shows, and what it expects.
using Security = std::variant<Psk>;

/// What a server shows and expects.
struct ServerSecurity {
  Psk psk;
};

}  // namespace millrace::cnc::ads
