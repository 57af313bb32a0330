#include "gateway/response.hpp"

#include <cassert>
#include <utility>

#include "base/messages/catalogue.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway {

tl::expected<Response, fabric::Message> Response::of(std::string text, std::uint32_t state,
                                                     fabric::CompletionSignal completion_signal) {
  if (completion_signal == fabric::CompletionSignal::response_state && state == 0) {
    return tl::unexpected(base::messages::response_state_zero());
  }
  if (completion_signal == fabric::CompletionSignal::response && text.empty()) {
    return tl::unexpected(base::messages::response_empty());
  }
  if (text.size() > fabric::max_text) {
    return tl::unexpected(base::messages::response_too_long(text.size(), fabric::max_text));
  }
  if (const auto nul = text.find('\0'); nul != std::string::npos) {
    return tl::unexpected(base::messages::response_with_nul(nul));
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
