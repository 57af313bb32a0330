// The list of revoked certificates of a CA (CRL).
//
//   const std::string list =
//       revocation_list({{serial, now}}, authority, key, now, authority.until());
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "base/openssl/certificate.hpp"

namespace millrace::base::openssl {

struct Revoked {
  /// As Certificate::serial() returns it.
  std::string serial;
  Time at;
  /// The common name of the certificate, recorded with the serial number for readers that only know
  /// names. May be empty.
  std::string name{};
};

/// In PEM. `until` is when readers need a newer list: after that Cyclone accepts no participant.
/// Throws std::invalid_argument for an invalid serial number.
std::string revocation_list(const std::vector<Revoked>& revoked, const Certificate& authority,
                            const Key& authority_key, Time from, Time until);

class RevocationList {
 public:
  static tl::expected<RevocationList, std::string> read(std::string_view pem);

  [[nodiscard]] bool is_issued_by(const Certificate& authority) const;
  [[nodiscard]] bool names(const Certificate& certificate) const;
  /// The common names recorded with the serial numbers.
  [[nodiscard]] std::set<std::string> common_names() const;
  /// When the list was made.
  [[nodiscard]] Time from() const;

 private:
  using Owner = std::unique_ptr<X509_CRL, Free<X509_CRL_free>>;
  explicit RevocationList(Owner list) : list_(std::move(list)) {}

  Owner list_;
};

}  // namespace millrace::base::openssl
