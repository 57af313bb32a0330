// A response that a channel can take: it was checked when it was made, so no later check is needed.
//
//   const auto response = Response::of(reply.text, reply.state);
//   if (!response) … response.error()          // "has 200 bytes, at most 127 fit"
//   writer.emplace(AnswerWriter::Kind::final, *response);
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "fabric/messages.hpp"

namespace millrace::gateway {

/// The state of an answer that stands for one which cannot be written, unless a policy names
/// another; the SDK's for a failed handler is the same (services/sdk/service.hpp).
inline constexpr std::uint32_t refused_state = 500;

/// At most 127 bytes without NUL, and with what its NC program waits for: a state that is not 0, or
/// a text.
class Response {
 public:
  /// The error says what is wrong, in words that go after "the answer ".
  static tl::expected<Response, fabric::Message> of(
      std::string text, std::uint32_t state,
      fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state);

  /// Words of ours in place of an answer. What is not a printable ASCII becomes '?', a text that
  /// does not fit ends in "..."; `state` is not 0.
  static Response in_words(std::string_view words, std::uint32_t state);

  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] std::uint32_t state() const { return state_; }
  bool operator==(const Response&) const = default;

 private:
  Response(std::string text, std::uint32_t state) : text_(std::move(text)), state_(state) {}

  std::string text_;
  std::uint32_t state_;
};

}  // namespace millrace::gateway
