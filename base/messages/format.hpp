// Formats a message as its text. Apart from message.hpp, since users of the SDK include that one,
// and need no fmt.
#pragma once

#include <string_view>

#include <fmt/format.h>

#include "base/messages/message.hpp"

template <>
struct fmt::formatter<millrace::base::messages::Message> : fmt::formatter<std::string_view> {
  auto format(const millrace::base::messages::Message& message,
              fmt::format_context& context) const {
    return fmt::formatter<std::string_view>::format(message.text, context);
  }
};
