// How the two ends of a Secure ADS connection know each other.
#pragma once

#include <cstdint>
#include <optional>
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

/// Each side has a certificate that it has signed itself; the other side knows its fingerprint,
/// which is all that counts: neither dates nor names do.
struct SelfSigned {
  /// In PEM, of an RSA key.
  std::string certificate;
  std::string key;
  /// Of the controller's certificate: SHA-256, "AB:CD:…".
  std::string fingerprint;
  bool operator==(const SelfSigned&) const = default;
};

/// Both sides have certificates that one authority has signed.
struct SharedCa {
  /// In PEM: the authority; our certificate, perhaps with others that lead to the authority; the
  /// RSA key of it.
  std::string ca;
  std::string certificate;
  std::string key;
  /// Of the controller's certificate; capitals do not count.
  std::string common_name;
  bool operator==(const SharedCa&) const = default;
};

/// What a client shows, and what it expects.
using Security = std::variant<Psk, SelfSigned, SharedCa>;

/// The certificate of a server, and who may add his own to those that it knows.
struct ServerSelfSigned {
  /// In PEM, of an RSA key.
  std::string certificate;
  std::string key;
  /// In CP1252.
  std::string user;
  std::string password;
};

/// The certificate of a server, and of whom those of its clients have to be. Their common names are
/// those of their hosts, or their addresses.
struct ServerSharedCa {
  /// In PEM, as in SharedCa.
  std::string ca;
  std::string certificate;
  std::string key;
  /// Common names may be any.
  bool ignore_common_name = false;
};

/// What a server shows and expects; certificates of one kind alone.
struct ServerSecurity {
  std::optional<Psk> psk{};
  std::optional<ServerSelfSigned> self_signed{};
  std::optional<ServerSharedCa> shared_ca{};
};

}  // namespace millrace::cnc::ads
