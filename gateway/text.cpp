#include "gateway/text.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"

namespace millrace::gateway {

std::string printable(std::string_view text) {
  std::string out(text);
  std::ranges::replace_if(
      out, [](char c) { return c < ' ' || c > '~'; }, '?');
  return out;
}

fabric::Message end_reason(RequestStatus status, const ServiceSnapshot& snapshot) {
  switch (status) {
    case RequestStatus::withdrawn:
      return base::messages::program_withdrew();
    case RequestStatus::replaced:
      return base::messages::program_replaced();
    case RequestStatus::answered:
      return base::messages::answered_elsewhere(snapshot.response_state);
    case RequestStatus::pending:
      return base::messages::program_new_request();
  }
  return {};
}

}  // namespace millrace::gateway
