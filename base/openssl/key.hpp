// A private key: NIST P-256, the ECDSA curve of DDS Security's built-in plugins, or RSA, which
// TwinCAT supports.
//
//   const Key key = Key::generate();
//   write_durably(file, key.pem(), owner_only);
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "base/openssl/owner.hpp"

namespace millrace::base::openssl {

class Key {
 public:
  /// Throws std::runtime_error if the host has no source of randomness.
  static Key generate();
  /// RSA with 2048 bits; throws likewise.
  static Key generate_rsa();
  /// Reads a key; `passphrase` decrypts an encrypted key and is otherwise ignored. The error is
  /// text for people, without a file's name: "is encrypted, and no passphrase is given".
  static tl::expected<Key, std::string> read(std::string_view pem,
                                             std::string_view passphrase = {});

  /// PKCS#8; encrypted (AES-256, PBKDF2) if there is a passphrase.
  [[nodiscard]] std::string pem(std::string_view passphrase = {}) const;
  [[nodiscard]] EVP_PKEY* get() const { return key_.get(); }

 private:
  using Owner = std::unique_ptr<EVP_PKEY, Free<EVP_PKEY_free>>;
  explicit Key(Owner key) : key_(std::move(key)) {}
  static Key made(EVP_PKEY* with);

  Owner key_;
};

}  // namespace millrace::base::openssl
