#include "base/openssl/signed_text.hpp"

#include <stdexcept>

#include <fmt/format.h>
#include <openssl/pkcs7.h>
#include <openssl/x509v3.h>

namespace millrace::base::openssl {

namespace {

using SignedOwner = std::unique_ptr<PKCS7, Free<PKCS7_free>>;
using StackOwner =
    std::unique_ptr<STACK_OF(X509), Free<[](STACK_OF(X509) * stack) { sk_X509_free(stack); }>>;

}  // namespace

std::string sign_text(std::string_view text, const Certificate& signer, const Key& key) {
  constexpr int flags = PKCS7_DETACHED | PKCS7_TEXT | PKCS7_STREAM;
  const BioOwner in = reading(text);
  const SignedOwner made(PKCS7_sign(signer.get(), key.get(), nullptr, in.get(), flags));
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
    return tl::unexpected(fmt::format("is not a signed document ({})", last_reason()));
  }
  const auto refuse = [&](std::string_view why) {
    return tl::unexpected(fmt::format("is not signed by {} ({})", authority.subject(), why));
  };
  const BioOwner out = writing();
  // NOVERIFY: the signer's certificate is checked below.
  if (PKCS7_verify(read.get(), nullptr, nullptr, content.get(), out.get(),
                   PKCS7_TEXT | PKCS7_NOVERIFY) != 1) {
    return refuse(last_reason());
  }
  const StackOwner signers(PKCS7_get0_signers(read.get(), nullptr, 0));
  if (!signers || sk_X509_num(signers.get()) != 1) {
    return refuse("expected one signature");
  }
  X509* const signer = sk_X509_value(signers.get(), 0);
  if (EVP_PKEY_eq(X509_get0_pubkey(signer), X509_get0_pubkey(authority.get())) != 1) {
    last_reason();
    return refuse("it is signed with another key");
  }
  // A root with the right key and name is not enough for a reader that builds a chain: it must be
  // this certificate.
  const bool is_root =
      X509_NAME_cmp(X509_get_subject_name(signer), X509_get_issuer_name(signer)) == 0;
  const bool counts = is_root ? X509_cmp(signer, authority.get()) == 0
                              : X509_check_issued(authority.get(), signer) == X509_V_OK &&
                                    X509_verify(signer, X509_get0_pubkey(authority.get())) == 1;
  last_reason();
  if (!counts) {
    return refuse("with a certificate that this CA has not issued");
  }
  return written(*out);
}

}  // namespace millrace::base::openssl
