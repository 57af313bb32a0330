#include "gateway/response.hpp"

#include <cassert>
#include <utility>

#include <fmt/format.h>

#include "gateway/text.hpp"

namespace millrace::gateway {

tl::expected<Response, std::string> Response::of(std::string text, std::uint32_t state,
                                                 fabric::CompletionSignal completion_signal) {
  if (completion_signal == fabric::CompletionSignal::response_state && state == 0) {
    return tl::unexpected(std::string("has state 0, which does not release the NC program"));
  }
  if (completion_signal == fabric::CompletionSignal::response && text.empty()) {
    return tl::unexpected(
        std::string("is empty, which does not release an NC program that waits for RESPONSE"));
  }
  if (text.size() > fabric::max_text) {
    return tl::unexpected(
        fmt::format("has {} bytes, at most {} fit", text.size(), fabric::max_text));
  }
  if (const auto nul = text.find('\0'); nul != std::string::npos) {
    return tl::unexpected(fmt::format("has a NUL at byte {}, where a CNC string would end", nul));
  }
  return Response(std::move(text), state);
}

Response Response::in_words(std::string_view words, std::uint32_t state) {
  assert(state != 0);
  constexpr std::string_view more = "...";
  std::string text = printable(words);
  if (text.size() > fabric::max_text) {
    text.resize(fabric::max_text - more.size());
    text += more;
  }
  return {std::move(text), state};
}

}  // namespace millrace::gateway
