// URLs of endpoints, parsed by libcurl, as it will use them.
#pragma once

#include <string>

#include <tl/expected.hpp>

namespace millrace::services::http {

struct Url {
  /// "http" or "https".
  std::string scheme{};
  /// An IPv6 address has its brackets.
  std::string host{};
  /// Also if the URL has none.
  std::string port{};

  [[nodiscard]] std::string host_and_port() const { return host + ":" + port; }
  [[nodiscard]] std::string origin() const { return scheme + "://" + host_and_port(); }
  /// The name says that the endpoint is on this host.
  [[nodiscard]] bool is_loopback() const {
    return host == "localhost" || host == "[::1]" || host.starts_with("127.");
  }
};

/// The error is what was expected.
tl::expected<Url, std::string> parse_url(const std::string& text);

/// The URL of a header Location in a response of `base`; the error says why it is not used: it is
/// none, or leads to another origin.
tl::expected<std::string, std::string> resolve(const std::string& base,
                                               const std::string& location);

}  // namespace millrace::services::http
