// A call as a POST request, and what its end means for the call. Pure.
//
//   const Post post = post_for(endpoint, request, left, now);
//   const Verdict v = judge(endpoint, exchange);
//
// States (docs/reference/services/http.md):
//   1           2xx with a text and without a state
//   400 to 599  the status of an HTTP error; also 300 to 399
//   11          the time limit was reached
//   13          the response cannot be written: form, length, code page, state 0
//   14          the call was cancelled; not delivered
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "fabric/messages.hpp"
#include "services/http/config.hpp"
#include "services/sdk/response.hpp"

namespace millrace::services::http {

inline constexpr std::uint32_t state_time_limit = 11;
inline constexpr std::uint32_t state_response_refused = 13;
inline constexpr std::uint32_t state_withdrawn = 14;

/// Bytes of a response that are read, with its headers; 127 characters have at most 762 as JSON.
inline constexpr std::size_t max_response = 65536;

struct Post {
  /// JSON.
  std::string body{};
  /// "NAME: VALUE"
  std::vector<std::string> headers{};
};

/// `left`: until the response is of no use. `now` is the time in the signature.
Post post_for(const Endpoint& endpoint, const fabric::Request& call, std::chrono::milliseconds left,
              fabric::Time now);

/// The headers that show who asks: for a POST, the polls of its result, and the health check.
std::vector<std::string> credentials(const Endpoint& endpoint);

/// The end of a transfer.
struct Exchange {
  enum class End : std::uint8_t {
    responded,
    /// Nothing of the request was sent.
    not_sent,
    /// At least a part of the request was sent, and the response is missing or incomplete.
    lost,
    /// Of the call, after it was sent.
    time_limit,
    /// The response has more than max_response bytes.
    too_long,
    not_http
  };
  End end = End::responded;
  int status = 0;
  std::string content_type{};
  std::string location{};
  std::optional<std::chrono::seconds> retry_after{};
  /// The header Millrace-State.
  std::string state{};
  std::string body{};
  /// Why there is no response.
  std::string reason{};
};

struct Answer {
  sdk::Response response{};
};
/// Nothing of the call was begun.
struct NotBegun {
  std::string reason{};
};
/// The endpoint has refused it for now.
struct NoRoom {
  std::string reason{};
  std::chrono::seconds pause{};
};
/// It may have run.
struct Lost {
  std::string reason{};
};
/// It runs; its result is at `url`.
struct Accepted {
  std::string url{};
  std::chrono::milliseconds pause{};
  std::optional<sdk::Response> interim{};
};
using Verdict = std::variant<Answer, NotBegun, NoRoom, Lost, Accepted>;

Verdict judge(const Endpoint& endpoint, const Exchange& exchange);

}  // namespace millrace::services::http
