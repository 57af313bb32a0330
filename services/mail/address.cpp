#include "services/mail/address.hpp"

#include <algorithm>

#include "base/text/characters.hpp"
#include "base/text/cp1252.hpp"
#include "base/text/trim.hpp"
#include "services/text/answer.hpp"

namespace millrace::services::mail {

namespace {

/// In characters (RFC 5321, 4.5.3.1): the longest local part, and the longest mailbox in a path.
constexpr std::size_t max_local = 64;
constexpr std::size_t max_mailbox = 254;

/// "atext" of RFC 5322.
bool is_local(char c) {
  constexpr std::string_view marks = "!#$%&'*+-/=?^_`{|}~";
  return base::text::is_alphanumeric(c) || marks.find(c) != std::string_view::npos;
}
bool is_domain(char c) {
  return base::text::is_alphanumeric(c) || c == '-';
}

/// True for parts of valid characters, separated by single dots.
bool is_dotted(std::string_view text, bool (*good)(char)) {
  return !text.empty() && text.front() != '.' && text.back() != '.' &&
         text.find("..") == std::string_view::npos &&
         std::all_of(text.begin(), text.end(), [&](char c) { return c == '.' || good(c); });
}

bool is_mailbox(std::string_view text) {
  const std::size_t at = text.rfind('@');
  return at != std::string_view::npos && text.size() <= max_mailbox && at <= max_local &&
         is_dotted(text.substr(0, at), is_local) && is_dotted(text.substr(at + 1), is_domain);
}

std::string_view without_quotes(std::string_view name) {
  const bool quoted = name.size() >= 2 && name.starts_with('"') && name.ends_with('"');
  return quoted ? name.substr(1, name.size() - 2) : name;
}

}  // namespace

tl::expected<Address, std::string> parse_address(std::string_view text) {
  Address address;
  std::string_view mailbox = base::text::trim(text, " ");
  if (mailbox.ends_with('>')) {
    const std::size_t open = mailbox.find('<');
    if (open == std::string_view::npos) {
      return tl::unexpected(text::in_quotes(text) + " has no '<'");
    }
    address.name = without_quotes(base::text::trim(mailbox.substr(0, open), " "));
    mailbox = mailbox.substr(open + 1, mailbox.size() - open - 2);
  }
  if (!is_mailbox(mailbox)) {
    return tl::unexpected(text::in_quotes(mailbox) +
                          " is not an address; expected user@example.com");
  }
  if (!base::text::is_utf8(address.name) ||
      std::any_of(address.name.begin(), address.name.end(), base::text::is_control)) {
    return tl::unexpected("the name of " + text::in_quotes(mailbox) + " is not one line of UTF-8");
  }
  address.mailbox = mailbox;
  return address;
}

std::string_view domain_of(const Address& address) {
  return std::string_view(address.mailbox).substr(address.mailbox.rfind('@') + 1);
}

}  // namespace millrace::services::mail
