#include "tools/web/live/messages.hpp"

#include <cctype>
#include <iterator>
#include <string_view>
#include <vector>

#include <boost/asio/ip/address.hpp>
#include <boost/beast/core/string.hpp>
#include <boost/beast/http/status.hpp>
#include <fmt/format.h>

#include "base/text/ascii.hpp"

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
  for (auto event = first; event != last; ++event) {
    all.append(all.empty() ? "" : ", ").append(event->value().data(), event->value().size());
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

std::string client_of(const Message& message, const std::string& peer,
                      const std::set<std::string>& trusted_proxies) {
  if (!trusted_proxies.contains(peer)) {
    return peer;
  }
  std::vector<std::string> chain;
  const auto [first, last] = message.equal_range("X-Forwarded-For");
  for (auto line = first; line != last; ++line) {
    std::string_view rest(line->value().data(), line->value().size());
    while (!rest.empty()) {
      const std::size_t comma = rest.find(',');
      chain.emplace_back(base::text::trim(rest.substr(0, comma)));
      rest = comma == std::string_view::npos ? std::string_view{} : rest.substr(comma + 1);
    }
  }
  std::string client = peer;
  while (!chain.empty() && trusted_proxies.contains(client)) {
    boost::system::error_code no_address;
    const auto address = boost::asio::ip::make_address(chain.back(), no_address);
    if (no_address) {
      break;
    }
    client = address.to_string();
    chain.pop_back();
  }
  return client;
}

bool has_known_length(const Message& message) {
  const auto [first, last] = message.equal_range("Transfer-Encoding");
  return first == last || (std::next(first) == last && message.count("Content-Length") == 0 &&
                           boost::beast::iequals(first->value(), "chunked"));
}

}  // namespace millrace::tools::web::live
