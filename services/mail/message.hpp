// A mail as bytes: RFC 5322 headers, encoded words (RFC 2047) and a body in UTF-8 (RFC 2045). Pure.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "fabric/messages.hpp"
#include "services/mail/address.hpp"

namespace millrace::services::mail {

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
