#include "tools/web/live/messages.hpp"

#include <cctype>
#include <string_view>

#include <boost/beast/http/status.hpp>
#include <fmt/format.h>

namespace millrace::tools::web::live {

namespace {

/// Header fields of all responses: they limit what the browser allows the page.
constexpr std::string_view protection =
    "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src "
    "'self'; connect-src 'self'; font-src 'self'; manifest-src 'self'; base-uri 'none'; "
    "form-action "
    "'none'; frame-ancestors 'none'\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "Referrer-Policy: no-referrer\r\n"
    "Cross-Origin-Opener-Policy: same-origin\r\n"
    "Cross-Origin-Resource-Policy: same-origin\r\n";

}  // namespace

std::string head_text(const http::Response& response, const AnswerHead& head) {
  const auto reason =
      boost::beast::http::obsolete_reason(boost::beast::http::int_to_status(response.status));
  std::string text =
      fmt::format("HTTP/1.1 {} {}\r\nContent-Type: {}\r\n", response.status,
                  std::string_view(reason.data(), reason.size()), response.content_type);
  text += protection;
  for (const auto& [name, value] : response.headers) {
    text += fmt::format("{}: {}\r\n", name, value);
  }
  if (!head.is_endless) {
    text += fmt::format("Content-Length: {}\r\n", head.length);
  }
  text += head.keep_alive ? "Connection: keep-alive\r\n\r\n" : "Connection: close\r\n\r\n";
  return text;
}

std::string attachment_header(std::string_view name) {
  std::string encoded;
  for (const char character : name) {
    const auto byte = static_cast<unsigned char>(character);
    if (std::isalnum(byte) != 0 || character == '-' || character == '.' || character == '_') {
      encoded += character;
    } else {
      encoded += fmt::format("%{:02X}", byte);
    }
  }
  return "attachment; filename*=UTF-8''" + encoded;
}

namespace {

std::string field(const Message& message, std::string_view name) {
  const auto value = message[boost::beast::string_view(name.data(), name.size())];
  return {value.data(), value.size()};
}

/// All of them: a proxy may have checked another one than the site would.
std::string hosts(const Message& message) {
  const auto [first, last] = message.equal_range("Host");
  std::string all;
  for (auto one = first; one != last; ++one) {
    all.append(all.empty() ? "" : ", ").append(one->value().data(), one->value().size());
  }
  return all;
}

}  // namespace

http::Request request_of(const Message& message, const std::string& peer) {
  const auto method = message.method_string();
  const auto target = message.target();
  return {.method = {method.data(), method.size()},
          .target = {target.data(), target.size()},
          .host = hosts(message),
          .origin = field(message, "Origin"),
          .fetch_site = field(message, "Sec-Fetch-Site"),
          .content_type = field(message, "Content-Type"),
          .cookie = field(message, "Cookie"),
          .token = field(message, "X-Millrace-Token"),
          .accept_encoding = field(message, "Accept-Encoding"),
          .if_none_match = field(message, "If-None-Match"),
          .body = message.body(),
          .peer = peer};
}

}  // namespace millrace::tools::web::live
