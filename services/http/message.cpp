#include "services/http/message.hpp"

#include <algorithm>
#include <array>

#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include "base/text/ascii.hpp"
#include "base/text/cp1252.hpp"
#include "services/http/url.hpp"
#include "services/text/answer.hpp"

namespace millrace::services::http {

namespace {

namespace json = boost::json;
using sdk::Response;
using Read = tl::expected<Response, std::string>;
using Wrong = tl::unexpected<std::string>;

constexpr int status_accepted = 202;
constexpr int status_multiple_choices = 300;
constexpr int status_bad_request = 400;
constexpr int status_proxy_password = 407;
constexpr int status_too_many = 429;
constexpr int status_unavailable = 503;
/// Between two polls of a result, unless the response has Retry-After.
constexpr std::chrono::milliseconds poll_pause{500};
constexpr std::chrono::seconds longest_pause{3600};

/// As in the specification of Standard Webhooks: of "ID.TIME.BODY", in Base64.
std::string signature(const std::string& secret, const std::string& content) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()),
       reinterpret_cast<const unsigned char*>(content.data()), content.size(), digest.data(),
       &size);
  std::array<unsigned char, 2 * EVP_MAX_MD_SIZE> text{};
  const int length = EVP_EncodeBlock(text.data(), digest.data(), static_cast<int>(size));
  return {text.begin(), text.begin() + length};
}

/// Without parameters, in small letters.
std::string media_type(const std::string& content_type) {
  return base::text::small_letters(std::string(
      base::text::trim(std::string_view(content_type).substr(0, content_type.find(';')))));
}

bool is_json(const std::string& type) {
  return type == "application/json" ||
         (type.starts_with("application/") && type.ends_with("+json"));
}

/// Flask, Express and Node-RED send a plain text as text/html; a page begins with '<'.
bool is_text(const std::string& type, const std::string& body) {
  return type.empty() || type == "text/plain" || (type == "text/html" && !body.starts_with('<'));
}

/// Programs on Windows begin UTF-8 with a byte order mark.
std::string_view without_mark(std::string_view body) {
  constexpr std::string_view mark = "\xEF\xBB\xBF";
  return body.starts_with(mark) ? body.substr(mark.size()) : body;
}

/// A response that can be written. `text` is UTF-8.
Read readable(const std::string& text, std::uint64_t state) {
  auto inside = base::text::to_cp1252(text);
  if (!inside) {
    return Wrong(inside.error());
  }
  if (inside->find('\0') != std::string::npos) {
    return Wrong("holds a NUL byte");
  }
  if (inside->size() > fabric::max_text) {
    return Wrong(fmt::format("{} bytes, at most 127 fit", inside->size()));
  }
  if (state > std::numeric_limits<std::uint32_t>::max()) {
    return Wrong(fmt::format("state {}; expected 1 to 4294967295", state));
  }
  return Response{.text = *std::move(inside), .state = static_cast<std::uint32_t>(state)};
}

Read from_json(const std::string& body) {
  boost::system::error_code error;
  const json::value value = json::parse(without_mark(body), error);
  if (error) {
    return Wrong("not JSON: " + error.message());
  }
  const json::object* const object = value.if_object();
  if (object == nullptr) {
    return Wrong("no JSON object");
  }
  const json::value* const text = object->if_contains("text");
  const json::value* const state = object->if_contains("state");
  if (text == nullptr && state == nullptr) {
    return Wrong("neither text nor state in its JSON");
  }
  if (text != nullptr && !text->is_string()) {
    return Wrong("its text is not a string");
  }
  std::uint64_t number = text::state_ok;
  if (state != nullptr) {
    boost::system::error_code not_whole;
    number = state->to_number<std::uint64_t>(not_whole);
    if (not_whole || state->is_double()) {
      return Wrong("its state is not a whole number");
    }
  }
  return readable(text == nullptr ? "" : std::string(text->get_string()), number);
}

Read from_text(const Exchange& exchange) {
  std::uint64_t state = text::state_ok;
  if (!exchange.state.empty()) {
    const auto number = base::text::parse_number<std::uint64_t>(exchange.state);
    if (!number) {
      return Wrong(fmt::format("Millrace-State: {}; expected a number", exchange.state));
    }
    state = *number;
  }
  std::string text(without_mark(exchange.body));
  text.erase(text.find_last_not_of("\r\n") + 1);
  return readable(text, state);
}

Read read_response(const Exchange& exchange) {
  const std::string type = media_type(exchange.content_type);
  if (is_json(type)) {
    return from_json(exchange.body);
  }
  if (is_text(type, exchange.body)) {
    return from_text(exchange);
  }
  return Wrong(fmt::format("{}; expected application/json or text/plain", type));
}

/// What an error response says, if that is one line of text that fits. Empty otherwise.
std::string detail(const Exchange& exchange) {
  std::string text;
  const std::string type = media_type(exchange.content_type);
  if (is_json(type)) {
    boost::system::error_code error;
    const json::value value = json::parse(without_mark(exchange.body), error);
    if (const json::object* const object = error ? nullptr : value.if_object()) {
      // "detail" is that of RFC 9457 and of FastAPI.
      for (const char* name : {"text", "detail", "title", "error"}) {
        const json::value* const found = object->if_contains(name);
        if (found != nullptr && found->is_string()) {
          text = found->get_string();
          break;
        }
      }
    }
  } else if (type == "text/plain") {
    text = exchange.body.substr(0, exchange.body.find_first_of("\r\n"));
  }
  return base::text::to_cp1252(text).value_or("");
}

Response http_error(const Exchange& exchange, std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return !text::prints(c); }, '?');
  return text::error(static_cast<std::uint32_t>(exchange.status),
                     fmt::format("HTTP {}{}{}", exchange.status, text.empty() ? "" : ": ", text));
}

Response refused(const Endpoint& endpoint, const std::string& why) {
  return text::error(state_response_refused,
                     fmt::format("response of {}: {}", endpoint.announcement.name, why));
}

std::chrono::seconds pause_of(const Exchange& exchange) {
  return std::clamp(exchange.retry_after.value_or(std::chrono::seconds(1)), std::chrono::seconds(1),
                    longest_pause);
}

/// 202 with Location.
Verdict accepted(const Endpoint& endpoint, const Exchange& exchange) {
  const auto url = resolve(endpoint.url, exchange.location);
  if (!url) {
    return Answer{refused(endpoint, url.error())};
  }
  Accepted accepted{
      .url = *url,
      .pause = exchange.retry_after ? std::chrono::milliseconds(pause_of(exchange)) : poll_pause};
  if (is_json(media_type(exchange.content_type))) {
    // Most bodies of 202 are about something else.
    if (const Read interim = from_json(exchange.body)) {
      accepted.interim = *interim;
    }
  }
  return accepted;
}

Verdict responded(const Endpoint& endpoint, const Exchange& exchange) {
  if (exchange.status == status_accepted && !exchange.location.empty()) {
    return accepted(endpoint, exchange);
  }
  if (exchange.status == status_proxy_password && !endpoint.proxy.empty()) {
    return NotBegun{"the proxy asks for a password: HTTP 407"};
  }
  if ((exchange.status == status_too_many || exchange.status == status_unavailable) &&
      exchange.retry_after) {
    return NoRoom{
        fmt::format("HTTP {} with Retry-After: {}", exchange.status, exchange.retry_after->count()),
        pause_of(exchange)};
  }
  if (exchange.status >= status_bad_request) {
    return Answer{http_error(exchange, detail(exchange))};
  }
  if (exchange.status >= status_multiple_choices) {
    return Answer{http_error(exchange, "is not followed; configure the URL it leads to")};
  }
  const Read read = read_response(exchange);
  if (!read) {
    return Answer{refused(endpoint, read.error())};
  }
  if (read->state == 0) {
    return Answer{refused(endpoint, "state 0; expected 1 or more")};
  }
  return Answer{*read};
}

}  // namespace

std::vector<std::string> credentials(const Endpoint& endpoint) {
  return endpoint.bearer_token.contents.empty()
             ? std::vector<std::string>{}
             : std::vector{"Authorization: Bearer " + endpoint.bearer_token.contents};
}

Post post_for(const Endpoint& endpoint, const fabric::Request& call, std::chrono::milliseconds left,
              fabric::Time now) {
  const std::string id = call.call.to_string();
  Post post{.body = json::serialize(json::object{{"uuid", base::text::to_utf8(call.uuid)},
                                                 {"text", base::text::to_utf8(call.text)},
                                                 {"state", call.state},
                                                 {"machine", call.key.machine},
                                                 {"channel", call.key.channel},
                                                 {"call", id},
                                                 {"attempt", call.attempt},
                                                 {"deadline_ms", left.count()},
                                                 {"replayed", call.replayed}}),
            .headers = credentials(endpoint)};
  for (const char* const header :
       {"Content-Type: application/json", "Accept: application/json, text/plain", "Expect:"}) {
    post.headers.emplace_back(header);
  }
  post.headers.push_back("Idempotency-Key: " + id);
  if (!endpoint.signing_secret.contents.empty()) {
    const auto time =
        std::chrono::duration_cast<std::chrono::seconds>(now.time_since_epoch()).count();
    post.headers.push_back("webhook-id: " + id);
    post.headers.push_back(fmt::format("webhook-timestamp: {}", time));
    post.headers.push_back(
        "webhook-signature: v1," +
        signature(endpoint.signing_secret.contents, fmt::format("{}.{}.{}", id, time, post.body)));
  }
  return post;
}

Verdict judge(const Endpoint& endpoint, const Exchange& exchange) {
  switch (exchange.end) {
    case Exchange::End::not_sent:
      return NotBegun{exchange.reason};
    case Exchange::End::lost:
      return Lost{exchange.reason};
    case Exchange::End::time_limit:
      return Answer{text::error(state_time_limit,
                                fmt::format("{} took longer than {} ms", endpoint.announcement.name,
                                            endpoint.time_limit.count()))};
    case Exchange::End::too_long:
      return Answer{refused(endpoint, fmt::format("more than {} bytes", max_response))};
    case Exchange::End::not_http:
      return Answer{refused(endpoint, "not HTTP: " + exchange.reason)};
    case Exchange::End::responded:
      break;
  }
  return responded(endpoint, exchange);
}

}  // namespace millrace::services::http
