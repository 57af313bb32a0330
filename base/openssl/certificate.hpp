// X.509 certificates: an authority's own, and those it gives to others.
//
//   const Certificate authority = self_signed(key, {.common_name = "plant identity", .until = …});
//   const Certificate member = issue(member_key, {.common_name = "gateway-1", …}, authority, key);
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "base/openssl/key.hpp"
#include "base/openssl/owner.hpp"

namespace millrace::base::openssl {

using Time = std::chrono::sys_seconds;

/// What a certificate says of its holder.
struct Subject {
  /// "O=…", the plant; at most 64 characters, as X.509 has it.
  std::string organisation;
  /// "CN=…", at most 64 characters.
  std::string common_name;
  /// "serialNumber=…", of the holder, not of the certificate; none if empty.
  std::string number{};
  Time from;
  Time until;
  /// Upper-case hexadecimal, as Certificate::serial() has it; drawn at random if empty.
  std::string serial{};
};

class Certificate {
 public:
  /// The error is for people, without a file's name.
  static tl::expected<Certificate, std::string> read(std::string_view pem);

  [[nodiscard]] std::string pem() const;
  [[nodiscard]] std::string common_name() const;
  [[nodiscard]] std::string organisation() const;
  /// As DDS Security's permissions name a holder: "CN=gateway-1,O=plant" (RFC 2253).
  [[nodiscard]] std::string subject() const;
  /// Upper-case hexadecimal.
  [[nodiscard]] std::string serial() const;
  [[nodiscard]] Time from() const;
  [[nodiscard]] Time until() const;
  /// SHA-256 of the whole certificate: "AB:CD:…", 32 bytes.
  [[nodiscard]] std::string fingerprint() const;
  /// The signature is that of `authority`'s key; looks at no dates.
  [[nodiscard]] bool is_issued_by(const Certificate& authority) const;
  [[nodiscard]] bool belongs_to(const Key& key) const;
  [[nodiscard]] X509* get() const { return certificate_.get(); }

 private:
  friend Certificate self_signed(const Key& key, const Subject& subject);
  friend Certificate issue(const Key& holder, const Subject& subject, const Certificate& authority,
                           const Key& authority_key);
  using Owner = std::unique_ptr<X509, Free<X509_free>>;
  explicit Certificate(Owner certificate) : certificate_(std::move(certificate)) {}

  Owner certificate_;
};

/// The fingerprint of a certificate that OpenSSL keeps; it is only read.
std::string fingerprint_of(const X509* certificate);
std::string common_name_of(const X509* certificate);
/// "AB:CD:…" of hexadecimal digits in small or capital letters, with colons, spaces or nothing
/// between the bytes; nothing unless there are 32.
std::optional<std::string> parse_fingerprint(std::string_view text);

/// The name in it as X.509 encodes it (DER). Throws std::invalid_argument for a subject that X.509
/// cannot hold.
std::string encoded_name(const Subject& subject);
/// An authority: may sign certificates and lists of revoked ones, or documents. Throws
/// std::invalid_argument for a subject that X.509 cannot hold.
Certificate self_signed(const Key& key, const Subject& subject);
/// Of a holder that may sign for himself and nothing else. Throws like self_signed.
Certificate issue(const Key& holder, const Subject& subject, const Certificate& authority,
                  const Key& authority_key);

}  // namespace millrace::base::openssl
