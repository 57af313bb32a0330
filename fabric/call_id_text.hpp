// The id of a call, read from text.
#pragma once

#include <optional>
#include <string_view>

#include "fabric/messages.hpp"

namespace millrace::fabric {

/// "5f3a9c0112d4-17", as CallId::to_string() writes it; nothing for another text.
std::optional<CallId> parse_call_id(std::string_view text);

}  // namespace millrace::fabric
