#include "services/http/url.hpp"

#include <memory>
#include <new>

#include <curl/curl.h>
#include <fmt/format.h>

namespace millrace::services::http {

namespace {

struct UrlDeleter {
  void operator()(CURLU* url) const { curl_url_cleanup(url); }
};
using Handle = std::unique_ptr<CURLU, UrlDeleter>;

Handle make() {
  Handle handle(curl_url());
  if (!handle) {
    throw std::bad_alloc();
  }
  return handle;
}

/// Empty if the URL does not have it.
std::string part(const Handle& url, CURLUPart which, unsigned flags = 0) {
  char* text = nullptr;
  if (curl_url_get(url.get(), which, &text, flags) != CURLUE_OK) {
    return {};
  }
  const std::unique_ptr<char, void (*)(void*)> owner(text, curl_free);
  return text;
}

Url url_of(const Handle& url) {
  return {.scheme = part(url, CURLUPART_SCHEME),
          .host = part(url, CURLUPART_HOST),
          .port = part(url, CURLUPART_PORT, CURLU_DEFAULT_PORT)};
}

}  // namespace

tl::expected<Url, std::string> parse_url(const std::string& text) {
  const Handle handle = make();
  if (const CURLUcode code = curl_url_set(handle.get(), CURLUPART_URL, text.c_str(), 0);
      code != CURLUE_OK) {
    return tl::unexpected(fmt::format(R"("{}" is not a URL: {})", text, curl_url_strerror(code)));
  }
  Url url = url_of(handle);
  if (url.scheme != "http" && url.scheme != "https") {
    return tl::unexpected(fmt::format(R"("{}"; expected http://… or https://…)", text));
  }
  if (!part(handle, CURLUPART_USER).empty() || !part(handle, CURLUPART_PASSWORD).empty()) {
    return tl::unexpected(
        std::string("has a user or password, which would be shown; see bearer_token_file"));
  }
  if (!part(handle, CURLUPART_FRAGMENT).empty()) {
    return tl::unexpected(fmt::format(R"("{}" has a fragment, which is not sent)", text));
  }
  return url;
}

tl::expected<std::string, std::string> resolve(const std::string& base,
                                               const std::string& location) {
  const Handle handle = make();
  if (curl_url_set(handle.get(), CURLUPART_URL, base.c_str(), 0) != CURLUE_OK) {
    return tl::unexpected(fmt::format("{} is not a URL", base));
  }
  const std::string origin = url_of(handle).origin();
  if (curl_url_set(handle.get(), CURLUPART_URL, location.c_str(), 0) != CURLUE_OK) {
    return tl::unexpected(fmt::format("its Location is not a URL: {}", location));
  }
  if (url_of(handle).origin() != origin) {
    return tl::unexpected(fmt::format("its Location leads to another host: {}", location));
  }
  return part(handle, CURLUPART_URL);
}

}  // namespace millrace::services::http
