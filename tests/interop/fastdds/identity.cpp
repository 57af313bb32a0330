#include "identity.hpp"

#include <algorithm>
#include <cctype>
#include <random>

namespace millrace::tests::interop::fastdds {

namespace {

constexpr std::string_view first_line = "millrace-instance 2\n";
constexpr std::string_view hexadecimal = "0123456789abcdef";

/// Control bytes and '%' as %XX.
std::string escaped(std::string_view value) {
  std::string text;
  for (const char c : value) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::iscntrl(byte) != 0 || c == '%') {
      text += '%';
      text += static_cast<char>(std::toupper(hexadecimal[byte / 16U]));
      text += static_cast<char>(std::toupper(hexadecimal[byte % 16U]));
    } else {
      text += c;
    }
  }
  return text;
}

bool follows_dash(std::size_t byte) {
  return byte == 4 || byte == 6 || byte == 8 || byte == 10;
}

}  // namespace

Id random_id() {
  std::random_device chance;
  Id id{};
  for (std::uint8_t& byte : id) {
    byte = static_cast<std::uint8_t>(chance());
  }
  // Version 4, variant 1.
  id[6] = static_cast<std::uint8_t>((id[6] & 0x0FU) | 0x40U);
  id[8] = static_cast<std::uint8_t>((id[8] & 0x3FU) | 0x80U);
  return id;
}

std::string text_of(const Id& id) {
  std::string text;
  for (std::size_t i = 0; i < id.size(); ++i) {
    if (follows_dash(i)) {
      text += '-';
    }
    text += hexadecimal[id.at(i) / 16U];
    text += hexadecimal[id.at(i) % 16U];
  }
  return text;
}

std::optional<Id> parse_id(std::string_view text) {
  Id id{};
  std::size_t at = 0;
  for (std::size_t i = 0; i < id.size(); ++i) {
    at += follows_dash(i) ? 1U : 0U;
    for (int half = 0; half < 2; ++half, ++at) {
      const auto digit = at < text.size() ? hexadecimal.find(text[at]) : std::string_view::npos;
      if (digit == std::string_view::npos) {
        return std::nullopt;
      }
      id.at(i) = static_cast<std::uint8_t>(id.at(i) * 16U + digit);
    }
  }
  return at == text.size() ? std::optional(id) : std::nullopt;
}

std::string reader_data(const Identity& identity) {
  std::string text(first_line);
  text += "id=" + text_of(identity.id) + '\n';
  text += "uuid=" + identity.uuid + '\n';
  text += "name=" + escaped(identity.name) + '\n';
  text += "host=" + escaped(identity.host) + '\n';
  text += "pid=" + std::to_string(identity.pid) + '\n';
  text += "delivery=at-least-once\n";
  text += "concurrency=" + std::to_string(identity.concurrency) + '\n';
  text += std::string("draining=") + (identity.draining ? "yes" : "no") + '\n';
  text += "lease_ms=" + std::to_string(identity.lease_ms) + '\n';
  return text;
}

std::string writer_data(const Id& instance) {
  return "instance=" + text_of(instance);
}

std::optional<Identity> parse_reader_data(std::string_view text) {
  if (!text.starts_with(first_line)) {
    return std::nullopt;
  }
  Identity identity;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    if (line.starts_with("id=")) {
      const auto id = parse_id(line.substr(3));
      if (!id) {
        return std::nullopt;
      }
      identity.id = *id;
    } else if (line.starts_with("uuid=")) {
      identity.uuid = line.substr(5);
    } else if (line.starts_with("draining=")) {
      identity.draining = line == "draining=yes";
    }
  }
  return identity;
}

}  // namespace millrace::tests::interop::fastdds
