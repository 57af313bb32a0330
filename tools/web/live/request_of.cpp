#include "tools/web/live/request_of.hpp"

#include <string_view>

namespace millrace::tools::web::live {

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
