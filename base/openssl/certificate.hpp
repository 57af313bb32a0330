// X.509 certificates: those of a CA, and those that it issues.
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

/// The subject of a certificate, and its validity and serial number.
struct Subject {
  /// "O=…", the plant; at most 64 characters (limit of X.509).
  std::string organisation;
  /// "CN=…", at most 64 characters.
  std::string common_name;
  /// "serialNumber=…" of the holder, not of the certificate; empty = none.
  std::string number{};
  Time from;
  Time until;
  /// Upper-case hexadecimal, as Certificate::serial() returns it; random if empty.
  std::string serial{};
};

class Certificate {
 public:
  /// The error is text for people, without a file's name.
  static tl::expected<Certificate, std::string> read(std::string_view pem);

  [[nodiscard]] std::string pem() const;
  [[nodiscard]] std::string common_name() const;
  [[nodiscard]] std::string organisation() const;
  /// The subject as DDS Security's permissions write it: "CN=gateway-1,O=plant" (RFC 2253).
  [[nodiscard]] std::string subject() const;
  /// Upper-case hexadecimal.
  [[nodiscard]] std::string serial() const;
  [[nodiscard]] Time from() const;
  [[nodiscard]] Time until() const;
  /// SHA-256 of the whole certificate: "AB:CD:…", 32 bytes.
  [[nodiscard]] std::string fingerprint() const;
  /// True if the key of `authority` has signed it; ignores all dates.
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

/// The fingerprint of a certificate that OpenSSL owns; it is only read.
std::string fingerprint_of(const X509* certificate);
std::string common_name_of(const X509* certificate);
/// Parses "AB:CD:…": hexadecimal digits in either case, with colons, spaces or nothing between the
/// bytes; nullopt unless there are 32.
std::optional<std::string> parse_fingerprint(std::string_view text);

/// The name in the subject as X.509 encodes it (DER). Throws std::invalid_argument for a subject
/// that X.509 cannot represent.
std::string encoded_name(const Subject& subject);
/// The certificate of a CA: may sign certificates and CRLs, or documents. Throws
/// std::invalid_argument for a subject that X.509 cannot represent.
Certificate self_signed(const Key& key, const Subject& subject);
/// The certificate of a holder that may sign for itself only, issued by `authority`. Throws like
/// self_signed().
Certificate issue(const Key& holder, const Subject& subject, const Certificate& authority,
                  const Key& authority_key);

}  // namespace millrace::base::openssl
