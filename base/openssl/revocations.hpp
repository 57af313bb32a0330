// The list of certificates that an authority takes back before their time (CRL).
//
//   const std::string list = revocation_list({{serial, now}}, authority, key, now,
//   authority.until());
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "base/openssl/certificate.hpp"

namespace millrace::base::openssl {

struct Revoked {
  /// As Certificate::serial() has it.
  std::string serial;
  Time at;
  /// Whose certificate it was: its common name. Noted beside the number, so that who only knows
  /// names knows whom not to believe any more. May be empty.
  std::string name{};
};

/// In PEM. `until` is when a reader has to have a newer one: after that Cyclone takes nobody.
/// Throws std::invalid_argument for a serial number that is none.
std::string revocation_list(const std::vector<Revoked>& revoked, const Certificate& authority,
                            const Key& authority_key, Time from, Time until);

class RevocationList {
 public:
  static tl::expected<RevocationList, std::string> read(std::string_view pem);

  [[nodiscard]] bool is_issued_by(const Certificate& authority) const;
  [[nodiscard]] bool names(const Certificate& certificate) const;
  /// The common names that are noted beside the numbers.
  [[nodiscard]] std::set<std::string> common_names() const;
  /// When it was made.
  [[nodiscard]] Time from() const;
  /// When a newer one has to be there.
  [[nodiscard]] Time until() const;

 private:
  using Owner = std::unique_ptr<X509_CRL, Free<X509_CRL_free>>;
  explicit RevocationList(Owner list) : list_(std::move(list)) {}

  Owner list_;
};

}  // namespace millrace::base::openssl
