#include "gateway/text.hpp"

#include <algorithm>

#include "base/messages/catalogue.hpp"

namespace millrace::gateway {

std::string printable(std::string_view text) {
  std::string out(text);
  std::ranges::replace_if(
      out, [](char c) { return c < ' ' || c > '~'; }, '?');
  return out;
}

fabric::Message printable_message(const fabric::Message& message) {
  fabric::Message out(printable(message.text));
  out.code = printable(message.code);
  for (const fabric::Message& argument : message.arguments) {
    out.arguments.push_back(printable_message(argument));
  }
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
