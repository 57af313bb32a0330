#include "base/openssl/signed_text.hpp"

#include <stdexcept>

#include <fmt/format.h>
#include <openssl/pkcs7.h>

namespace millrace::base::openssl {

namespace {

using SignedOwner = std::unique_ptr<PKCS7, Free<PKCS7_free>>;
using StackOwner =
    std::unique_ptr<STACK_OF(X509), Free<[](STACK_OF(X509) * stack) { sk_X509_free(stack); }>>;

}  // namespace

std::string sign_text(std::string_view text, const Certificate& authority,
                      const Key& authority_key) {
  constexpr int flags = PKCS7_DETACHED | PKCS7_TEXT | PKCS7_STREAM;
  const BioOwner in = reading(text);
  const SignedOwner made(
      PKCS7_sign(authority.get(), authority_key.get(), nullptr, in.get(), flags));
  const BioOwner out = writing();
  if (!made || SMIME_write_PKCS7(out.get(), made.get(), in.get(), flags) != 1) {
    throw std::runtime_error(fmt::format("cannot sign a document: {}", last_reason()));
  }
  return written(*out);
}

tl::expected<std::string, std::string> verified_text(std::string_view document,
                                                     const Certificate& authority) {
  const BioOwner in = reading(document);
  BIO* beside = nullptr;
  const SignedOwner read(SMIME_read_PKCS7(in.get(), &beside));
  const BioOwner content(beside);
  if (!read || !content) {
    return tl::unexpected(fmt::format("is no signed document ({})", last_reason()));
  }
  const StackOwner signers(sk_X509_new_null());
  sk_X509_push(signers.get(), authority.get());
  const BioOwner out = writing();
  // NOINTERN: only the authority may have signed it. NOVERIFY: it needs no chain above itself.
  if (PKCS7_verify(read.get(), signers.get(), nullptr, content.get(), out.get(),
                   PKCS7_TEXT | PKCS7_NOVERIFY | PKCS7_NOINTERN) != 1) {
    return tl::unexpected(
        fmt::format("is not signed by {} ({})", authority.subject(), last_reason()));
  }
  return written(*out);
}

}  // namespace millrace::base::openssl
