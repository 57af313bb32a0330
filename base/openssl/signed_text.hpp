// A document with its detached signature, as DDS Security uses it for governance and permissions:
// S/MIME, multipart/signed, of type text/plain.
//
//   const std::string document = sign_text(permissions, authority, key);
//   const auto text = verified_text(document, authority);
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "base/openssl/certificate.hpp"

namespace millrace::base::openssl {

/// The document includes `signer`: the certificate of the CA, or one that it has issued for its own
/// key. Throws std::runtime_error if signing fails.
std::string sign_text(std::string_view text, const Certificate& signer, const Key& key);

/// The signed text, if the key of `authority` has signed it and the included certificate is the
/// CA's or issued by it. Other keys are refused, even with a certificate of the CA. Ignores all
/// dates. The error is text for people, without a file's name.
tl::expected<std::string, std::string> verified_text(std::string_view document,
                                                     const Certificate& authority);

}  // namespace millrace::base::openssl
