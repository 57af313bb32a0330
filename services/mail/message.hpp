// A mail as bytes: RFC 5322 headers, encoded words (RFC 2047) and a body in UTF-8 (RFC 2045). Pure.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/messages.hpp"

namespace millrace::services::mail {

// Mail addresses in configurations. Pure.
//
//   parse_address("Press 1 <press1@example.com>").value() ==
//       Address{"Press 1", "press1@example.com"}

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

struct Content {
  Address from{};
  std::vector<Address> to{};
  fabric::Time date{};
  /// "user@domain" without brackets; the same for the same mail.
  std::string message_id{};
  /// UTF-8.
  std::string subject{};
  std::string text{};
};

/// ASCII; lines end in CR LF and have at most 76 characters, plus the length of one unbreakable
/// address. Control characters become blanks, so that no text can end a header line or begin a new
/// one.
std::string to_message(const Content& content);

/// The text of an unstructured header in ASCII: unchanged, or as encoded words, folded.
std::string header_text(std::string_view utf8);

/// The body in quoted-printable form (RFC 2045, 6.7), with any line end as CR LF.
std::string quoted_printable(std::string_view utf8);

}  // namespace millrace::services::mail
