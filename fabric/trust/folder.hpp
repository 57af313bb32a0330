// The credentials of a host on a fabric with trust: the folder that `millrace trust issue` fills.
//
//   auto credentials = read_folder("/etc/millrace/trust/square-root", Protection::sign, now);
//   if (!credentials) return tl::unexpected(credentials.error());
//   options.configuration += credentials->cyclone_configuration;
#pragma once

#include <chrono>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/trust/permissions.hpp"

namespace millrace::fabric::trust {

/// Names in the folder.
namespace files {
/// The CA that signs identity certificates.
inline constexpr std::string_view identity_authority = "identity_authority.pem";
/// The CA that signs permissions.
inline constexpr std::string_view permissions_authority = "permissions_authority.pem";
inline constexpr std::string_view certificate = "certificate.pem";
inline constexpr std::string_view key = "key.pem";
/// The CRL.
inline constexpr std::string_view revoked = "revoked.pem";
inline constexpr std::string_view permissions = "permissions.p7s";
inline constexpr std::string_view governance_sign = "governance_sign.p7s";
inline constexpr std::string_view governance_encrypt = "governance_encrypt.p7s";
}  // namespace files

std::string_view governance_file(Protection protection);

/// The credentials from the folder.
struct Credentials {
  /// As it was named: if it is a link, its target may change later.
  std::filesystem::path folder;
  /// The certificate's common name.
  std::string name;
  std::chrono::sys_seconds from;
  std::chrono::sys_seconds until;
  /// The revoked names, and the time of the CRL.
  std::set<std::string> revoked;
  std::chrono::sys_seconds revoked_as_of;
  /// The partitions of its identity, from its permissions.
  std::vector<std::string> identity_partitions;
  /// A fragment for the participant: <Security>…</Security>.
  std::string cyclone_configuration;
};

/// Reads everything and checks what Cyclone would reject without a useful message: a missing file,
/// a key that other users of the host can read or that belongs to another certificate, a
/// certificate of another CA, expired, not yet valid or revoked, a CRL that is older than the
/// certificate, a document that the CA has not signed, or has signed for another participant, time
/// or protection. The error is one line with the file and the remedy.
tl::expected<Credentials, std::string> read_folder(const std::filesystem::path& folder,
                                                   Protection protection,
                                                   std::chrono::sys_seconds now);

/// The names on the folder's CRL; the error names the file and the remedy.
tl::expected<std::set<std::string>, std::string> read_revoked(const std::filesystem::path& folder);

}  // namespace millrace::fabric::trust
