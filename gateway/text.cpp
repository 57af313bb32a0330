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
      return "the program took the request back";
    case RequestStatus::replaced:
      return "the program put another request in its place";
    case RequestStatus::answered:
      return fmt::format("somebody else answered it with RESPONSE_STATE {}",
                         snapshot.response_state);
    case RequestStatus::pending:
      return "the program asks anew";
  }
  return {};
}

}  // namespace millrace::gateway
