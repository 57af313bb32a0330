// Mail addresses in configurations. Pure.
//
//   parse_address("Press 1 <press1@example.com>").value() ==
//       Address{"Press 1", "press1@example.com"}
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace millrace::services::mail {

struct Address {
  /// UTF-8; may be empty.
  std::string name{};
  /// ASCII, "user@example.com".
  std::string mailbox{};
  bool operator==(const Address&) const = default;
};

/// "NAME <MAILBOX>" or "MAILBOX". A mailbox is a dot-atom, '@' and a domain (RFC 5322, 3.4.1,
/// without quoted strings and domain literals), at most 254 bytes. The error is the fault in the
/// address.
tl::expected<Address, std::string> parse_address(std::string_view text);

/// The part after the '@'.
std::string_view domain_of(const Address& address);

}  // namespace millrace::services::mail
