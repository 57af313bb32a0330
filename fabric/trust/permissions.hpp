// What one participant may do, as DDS Security reads it: the permissions document. Pure.
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

/// Where a document lets its participant show an identity (fabric/participant_identity.hpp);
/// nothing in one that an earlier version has made.
std::vector<std::string> identity_partitions_in(std::string_view document);

/// Whether a document is about the holder of a certificate with this subject, for the time that is
/// given; else what it is instead, for people: "is about CN=gateway-1,O=plant".
std::optional<std::string> mismatch_in(std::string_view document, std::string_view subject,
                                       std::chrono::sys_seconds from,
                                       std::chrono::sys_seconds until);

}  // namespace millrace::fabric::trust
