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

/// Throws std::runtime_error if it cannot be signed.
std::string sign_text(std::string_view text, const Certificate& authority,
                      const Key& authority_key);

/// What was signed, if `authority` itself has signed it: no other certificate counts, whoever has
/// issued that. The error is for people, without a file's name.
tl::expected<std::string, std::string> verified_text(std::string_view document,
                                                     const Certificate& authority);

}  // namespace millrace::base::openssl
