#include "gateway/text.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace millrace::gateway {

std::string printable(std::string_view text) {
  std::string out(text);
  std::ranges::replace_if(
      out, [](char c) { return c < ' ' || c > '~'; }, '?');
  return out;
}

std::string truncate_reason(std::string text) {
  constexpr std::size_t most = 255;
  if (text.size() > most) {
    text.replace(most - 3, text.size(), "...");
  }
  return text;
}

std::string end_reason(RequestStatus status, const ServiceSnapshot& snapshot) {
  switch (status) {
    case RequestStatus::withdrawn:
      return "the NC program withdrew the request";
    case RequestStatus::replaced:
      return "the NC program replaced the request";
    case RequestStatus::answered:
      return fmt::format("another writer set RESPONSE_STATE to {}", snapshot.response_state);
    case RequestStatus::pending:
      return "the NC program made a new request";
  }
  return {};
}

}  // namespace millrace::gateway
