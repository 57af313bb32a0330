// The two CAs of a PKI: one signs identities, the other permissions. Neither signs the other's
// documents, so that no participant can write its own permissions with its identity key.
//
//   const CertificateAuthorities authorities = CertificateAuthorities::create("plant", until, now);
//   authorities.write(folder, passphrase);
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>

#include <sys/types.h>
#include <tl/expected.hpp>

#include "base/openssl/certificate.hpp"
#include "base/openssl/revocations.hpp"
#include "fabric/trust/participant.hpp"

namespace millrace::tools::trust {

using Time = std::chrono::sys_seconds;

/// Of private keys, and of folders that hold them.
inline constexpr mode_t owner_only = 0600;
inline constexpr mode_t owner_folder = 0700;
/// Of what is not secret.
inline constexpr mode_t everybody_reads = 0644;

/// The files of a participant's folder, by name; the key is among them.
struct CredentialFiles {
  struct File {
    std::string name;
    std::string content;
    bool secret = false;
  };
  std::vector<File> files;
  /// Of the certificate.
  std::string serial;
};

class CertificateAuthorities {
 public:
  /// Creates both keys. Throws std::invalid_argument for a name that a certificate cannot hold.
  static CertificateAuthorities create(std::string_view plant, Time from, Time until);
  /// From the folder that write() has filled. The error names the file and the remedy.
  static tl::expected<CertificateAuthorities, std::string> read(const std::filesystem::path& folder,
                                                                std::string_view passphrase);
  /// Creates the folder, for its owner alone; the keys are encrypted if there is a passphrase.
  [[nodiscard]] tl::expected<void, std::string> write(const std::filesystem::path& folder,
                                                      std::string_view passphrase) const;

  /// The same two keys and names, valid for longer: earlier signatures stay valid with the new
  /// certificates, and later ones are valid with the old ones.
  void renew(Time until);
  /// Replaces the old certificates with new ones; keys stay the same.
  [[nodiscard]] tl::expected<void, std::string> write_certificates(
      const std::filesystem::path& folder) const;
  /// The validity of the CAs in the folder; needs no passphrase.
  static tl::expected<Time, std::string> end_of(const std::filesystem::path& folder);

  /// A new key, a certificate and permissions of the same validity, and the common files of all
  /// participants. A `foreign` participant gets a name that makes the others begin the handshake:
  /// see late_number().
  [[nodiscard]] CredentialFiles issue(const fabric::trust::Participant& participant, bool foreign,
                                      std::string_view fabric, Time from, Time until,
                                      const std::vector<base::openssl::Revoked>& revoked) const;
  /// The CRL, as each participant has it.
  [[nodiscard]] std::string revocations(const std::vector<base::openssl::Revoked>& revoked,
                                        Time now) const;

  /// No certificate from them can be valid for longer.
  [[nodiscard]] Time until() const { return identity_.certificate.until(); }

 private:
  struct Authority {
    base::openssl::Key key;
    base::openssl::Certificate certificate;
  };
  CertificateAuthorities(Authority identity, Authority permissions)
      : identity_(std::move(identity)), permissions_(std::move(permissions)) {}

  Authority identity_;
  Authority permissions_;
};

}  // namespace millrace::tools::trust
