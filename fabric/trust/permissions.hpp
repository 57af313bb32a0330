// The permissions document of one participant, for DDS Security. Pure.
//
//   sign_text(permissions_document(grants_of(participant, fabric), certificate.subject(), from, until),
//   authority, key);
#pragma once

#include <chrono>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fabric/trust/participant.hpp"

namespace millrace::fabric::trust {

// Show what a participant may write and read: the one place that says it. Pure.
//
//   for (const Grant& grant : grants_of(participant, "millrace")) …  // {write, "millrace/v5/reply",
//   "millrace/560aacbf-…"}

enum class Access : std::uint8_t { write, read };

/// One topic in one partition.
struct Grant {
  Access access;
  std::string topic;
  /// A pattern for fnmatch; each partition of an endpoint must match it literally.
  std::string partition;

  auto operator<=>(const Grant&) const = default;
};

/// Sorted, without repeats. Everything else is denied. The participant has passed mistake_in().
std::vector<Grant> grants_of(const Participant& participant, std::string_view fabric);

/// `subject` is that of the certificate, in RFC 2253's form. Whatever is not granted is denied.
std::string permissions_document(const std::vector<Grant>& grants, std::string_view subject,
                                 std::chrono::sys_seconds from, std::chrono::sys_seconds until);

/// The partitions of the identity in a document (fabric/participant_identity.hpp); nullopt in a
/// document of an earlier version.
std::vector<std::string> identity_partitions_in(std::string_view document);

/// Whether a document belongs to a certificate with this subject and this validity; else the
/// difference, for people: "is made for CN=gateway-1,O=plant".
std::optional<std::string> mismatch_in(std::string_view document, std::string_view subject,
                                       std::chrono::sys_seconds from,
                                       std::chrono::sys_seconds until);

// The protection of a whole fabric, the same for all its participants: the governance document of
// DDS Security. Pure.
//
//   sign_text(governance_document(Protection::sign), authority, key);

enum class Protection : std::uint8_t {
  /// Samples cannot be changed or forged; any listener can read them.
  sign,
  /// Nor read it.
  encrypt
};

/// "SIGN", "ENCRYPT".
std::string_view name_of(Protection protection);

/// Cyclone's plugins know no domains beyond this one.
inline constexpr std::uint32_t last_domain = 230;

/// All topics of all domains; participants need credentials, and each endpoint is checked.
std::string governance_document(Protection protection);

/// Whether a document that has been signed is the one above; line ends do not count, which signing
/// changes.
bool is_governance(std::string_view document, Protection protection);

}  // namespace millrace::fabric::trust
