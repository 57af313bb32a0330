#include "base/openssl/key.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <openssl/ec.h>
#include <openssl/pem.h>
#include <openssl/rsa.h>

namespace millrace::base::openssl {

namespace {

/// State of OpenSSL's passphrase callback. Without it the library would prompt on the terminal.
struct Asked {
  std::string_view passphrase;
  bool was_asked = false;
};

int give_passphrase(char* buffer, int size, int /*writing*/, void* user) {
  auto& asked = *static_cast<Asked*>(user);
  asked.was_asked = true;
  if (asked.passphrase.empty() || asked.passphrase.size() > static_cast<std::size_t>(size)) {
    return -1;
  }
  std::ranges::copy(asked.passphrase, buffer);
  return static_cast<int>(asked.passphrase.size());
}

}  // namespace

Key Key::generate() {
  return made(EVP_EC_gen("P-256"));
}

Key Key::generate_rsa() {
  constexpr std::size_t bits = 2048;
  return made(EVP_RSA_gen(bits));
}

Key Key::made(EVP_PKEY* with) {
  Owner key(with);
  if (!key) {
    throw std::runtime_error(fmt::format("cannot make a key: {}", last_reason()));
  }
  return Key(std::move(key));
}

tl::expected<Key, std::string> Key::read(std::string_view pem, std::string_view passphrase) {
  const BioOwner in = reading(pem);
  Asked asked{passphrase};
  Owner key(PEM_read_bio_PrivateKey(in.get(), nullptr, &give_passphrase, &asked));
  if (key) {
    return Key(std::move(key));
  }
  const std::string reason = last_reason();
  if (asked.was_asked && passphrase.empty()) {
    return tl::unexpected(std::string("is encrypted, and no passphrase is given"));
  }
  if (asked.was_asked) {
    return tl::unexpected(std::string("does not open with this passphrase"));
  }
  return tl::unexpected(fmt::format("is not a private key in PEM ({})", reason));
}

std::string Key::pem(std::string_view passphrase) const {
  const BioOwner out = writing();
  Asked asked{passphrase};
  const EVP_CIPHER* cipher = passphrase.empty() ? nullptr : EVP_aes_256_cbc();
  if (PEM_write_bio_PKCS8PrivateKey(out.get(), key_.get(), cipher, nullptr, 0, &give_passphrase,
                                    &asked) != 1) {
    throw std::runtime_error(fmt::format("cannot write a key: {}", last_reason()));
  }
  return written(*out);
}

}  // namespace millrace::base::openssl
