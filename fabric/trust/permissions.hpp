// The permissions document of one participant, for DDS Security. Pure.
//
//   sign_text(permissions_document(grants_of(participant, fabric), certificate.subject(), from, until),
//   authority, key);
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fabric/trust/grants.hpp"

namespace millrace::fabric::trust {

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

}  // namespace millrace::fabric::trust
