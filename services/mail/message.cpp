#include "services/mail/message.hpp"

#include <algorithm>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "base/text/controls.hpp"
#include "base/text/cp1252.hpp"
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

namespace {

/// RFC 2045 and 2047: the most characters of a line, and of an encoded word.
constexpr std::size_t max_line = 76;
constexpr std::size_t max_word = 75;
constexpr std::string_view word_start = "=?utf-8?Q?";
constexpr std::string_view word_end = "?=";
/// Room for the longest header name before the first word.
constexpr std::size_t name_room = 12;

bool is_ascii(std::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}
std::string without_controls(std::string_view text) {
  std::string clean;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto control = base::text::control_at(text.substr(i));
    clean += control ? ' ' : text[i];
    i += control ? control->size - 1 : 0;
  }
  return clean;
}

/// The bytes of the first character of `text`; an invalid first byte counts as one. At most the
/// length of a UTF-8 character: a longer run of invalid bytes would not fit into a word.
std::string_view first_character(std::string_view text) {
  constexpr std::size_t longest = 4;
  std::size_t size = 1;
  while (size < std::min(text.size(), longest) &&
         (static_cast<unsigned char>(text[size]) & 0xC0U) == 0x80U) {
    ++size;
  }
  return text.substr(0, size);
}

/// A character in an encoded word, as strict as before an address (RFC 2047, 5.3).
std::string in_word(std::string_view character) {
  std::string out;
  for (const char c : character) {
    if (base::text::is_alphanumeric(c)) {
      out += c;
    } else if (c == ' ') {
      out += '_';
    } else {
      out += fmt::format("={:02X}", static_cast<unsigned char>(c));
    }
  }
  return out;
}

std::string encoded_words(std::string_view text) {
  std::string out(word_start);
  std::size_t room = max_word - word_start.size() - word_end.size() - name_room;
  while (!text.empty()) {
    const std::string_view character = first_character(text);
    const std::string coded = in_word(character);
    if (coded.size() > room) {
      // Words separated by a fold are read as one.
      out += fmt::format("{}\r\n {}", word_end, word_start);
      room = max_word - word_start.size() - word_end.size() - 1;
    }
    out += coded;
    room -= coded.size();
    text.remove_prefix(character.size());
  }
  return out + std::string(word_end);
}

std::string display_name(const std::string& name) {
  const auto is_atom = [](char c) {
    return base::text::is_alphanumeric(c) || c == ' ' || c == '-' || c == '_';
  };
  if (std::all_of(name.begin(), name.end(), is_atom) && name.size() < max_line / 2) {
    return name;
  }
  return encoded_words(without_controls(name));
}

std::string to_header(const Address& address) {
  return address.name.empty() ? address.mailbox
                              : fmt::format("{} <{}>", display_name(address.name), address.mailbox);
}

std::string to_header(const std::vector<Address>& addresses) {
  std::string out;
  for (const Address& address : addresses) {
    out += (out.empty() ? "" : ",\r\n ") + to_header(address);
  }
  return out;
}

/// Lines without their ends: LF, CR LF or CR.
std::vector<std::string_view> lines(std::string_view text) {
  std::vector<std::string_view> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    lines.push_back(text.substr(0, end));
    text.remove_prefix(end);
    text.remove_prefix(text.starts_with("\r\n") ? 2 : std::min<std::size_t>(text.size(), 1));
  }
  return lines;
}

/// Appends one line, with soft line breaks where it is too long.
void append_quoted(std::string& out, std::string_view line) {
  std::size_t column = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    const bool last = i + 1 == line.size();
    const bool plain = (c > ' ' && c < 0x7F && c != '=') || ((c == ' ' || c == '\t') && !last);
    const std::string coded =
        plain ? std::string(1, c) : fmt::format("={:02X}", static_cast<unsigned char>(c));
    if (column + coded.size() > max_line - 1) {
      out += "=\r\n";
      column = 0;
    }
    out += coded;
    column += coded.size();
  }
  out += "\r\n";
}

std::string date_header(fabric::Time time) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  return fmt::format("{:%a, %d %b %Y %H:%M:%S} +0000",
                     fmt::gmtime(std::chrono::system_clock::to_time_t(seconds)));
}

}  // namespace

std::string header_text(std::string_view utf8) {
  const std::string text = without_controls(utf8);
  const bool as_it_is = is_ascii(text) && text.find("=?") == std::string::npos &&
                        text.size() <= max_line - name_room && !text.starts_with(' ') &&
                        !text.ends_with(' ');
  return as_it_is ? text : encoded_words(text);
}

std::string quoted_printable(std::string_view utf8) {
  std::string out;
  for (const std::string_view line : lines(utf8)) {
    append_quoted(out, line);
  }
  return out;
}

std::string to_message(const Content& content) {
  std::string out;
  const auto header = [&out](std::string_view name, std::string_view value) {
    out += fmt::format("{}: {}\r\n", name, value);
  };
  header("Date", date_header(content.date));
  header("From", to_header(content.from));
  header("To", to_header(content.to));
  header("Message-ID", fmt::format("<{}>", content.message_id));
  header("Subject", header_text(content.subject));
  // RFC 3834: prevents automatic replies, such as holiday notices.
  header("Auto-Submitted", "auto-generated");
  header("MIME-Version", "1.0");
  header("Content-Type", "text/plain; charset=utf-8");
  header("Content-Transfer-Encoding", "quoted-printable");
  return out + "\r\n" + quoted_printable(content.text);
}

}  // namespace millrace::services::mail
