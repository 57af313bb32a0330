// A document with its signature beside it, as DDS Security has governance and permissions: S/MIME,
// multipart/signed, of type text/plain.
//
//   const std::string document = sign_text(permissions, authority, key);
//   const auto text = verified_text(document, authority);
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "base/openssl/certificate.hpp"

namespace millrace::base::openssl {

/// `signer` goes with it: the certificate of the authority, or one that it has given its own key.
/// Throws std::runtime_error if it cannot be signed.
std::string sign_text(std::string_view text, const Certificate& signer, const Key& key);

/// What was signed, if the key of `authority` has signed it, and the certificate that goes with it
/// is either the authority's or given by it: no other key counts, whoever has issued it a
/// certificate. Looks at no dates. The error is for people, without a file's name.
tl::expected<std::string, std::string> verified_text(std::string_view document,
                                                     const Certificate& authority);

}  // namespace millrace::base::openssl
