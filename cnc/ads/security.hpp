// How the two ends of a Secure ADS connection authenticate each other.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace millrace::cnc::ads {

/// TCP port of Secure ADS (documented, IB/tc3_grundlagen "Secure ADS").
inline constexpr std::uint16_t secure_port = 8016;

/// A pre-shared key, which TwinCAT derives from an identity (case-insensitive) and a password.
struct Psk {
  std::string identity;
  std::string password;
  bool operator==(const Psk&) const = default;
};

/// Each side has a self-signed certificate whose fingerprint the other side knows. Only the
/// fingerprint is checked, neither dates nor names.
struct SelfSigned {
  /// In PEM, of an RSA key.
  std::string certificate;
  std::string key;
  /// SHA-256 fingerprint of the controller's certificate, "AB:CD:…".
  std::string fingerprint;
  bool operator==(const SelfSigned&) const = default;
};

/// Both sides have certificates that one CA has signed.
struct SharedCa {
  /// In PEM: the CA; our certificate, optionally with intermediate certificates up to the CA; its
  /// RSA key.
  std::string ca;
  std::string certificate;
  std::string key;
  /// Common name of the controller's certificate, case-insensitive.
  std::string common_name;
  bool operator==(const SharedCa&) const = default;
};

/// The credentials of a client, and what it expects of the controller.
using Security = std::variant<Psk, SelfSigned, SharedCa>;

/// The certificate of a server, and the user who may add a client's certificate to the known ones.
struct ServerSelfSigned {
  /// In PEM, of an RSA key.
  std::string certificate;
  std::string key;
  /// In CP1252.
  std::string user;
  std::string password;
};

/// The certificate of a server, and the CA of its clients' certificates. A client's common name is
/// its IP address or one of `clients`; the client's own statement about its host proves nothing.
struct ServerSharedCa {
  /// In PEM, as in SharedCa.
  std::string ca;
  std::string certificate;
  std::string key;
  /// Accepts any common name.
  bool ignore_common_name = false;
  std::vector<std::string> clients{};
};

/// The credentials of a server and what it expects of clients; certificates of one kind only.
struct ServerSecurity {
  std::optional<Psk> psk{};
  std::optional<ServerSelfSigned> self_signed{};
  std::optional<ServerSharedCa> shared_ca{};
};

}  // namespace millrace::cnc::ads
