#include "fabric/call_id_text.hpp"

#include "base/text/number.hpp"

namespace millrace::fabric {

std::optional<CallId> parse_call_id(std::string_view text) {
  const std::size_t dash = text.find('-');
  if (dash == std::string_view::npos) {
    return std::nullopt;
  }
  const auto epoch = base::text::parse_number<std::uint64_t>(text.substr(0, dash), 16);
  const auto number = base::text::parse_number<std::uint64_t>(text.substr(dash + 1));
  return epoch && number ? std::optional(CallId{*epoch, *number}) : std::nullopt;
}

}  // namespace millrace::fabric
