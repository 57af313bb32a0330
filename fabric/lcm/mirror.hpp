// Calls and events of a fabric as LCM messages, for lcm-spy, lcm-logger and readers of their logs.
// Pure.
//
//   if (const auto message = mirrored(entry)) publish(message->channel, message->bytes);
//   …
//   const auto entry = entry_of(event.channel, event.data);   // the same entry again
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "fabric/observer/entry.hpp"

namespace millrace::fabric::lcm {

struct Message {
  std::string channel{};
  std::string bytes{};
};

/// Requests, replies, withdrawals and events, on "MILLRACE_MIRROR.request" and so on; nothing for
/// other entries.
std::optional<Message> mirrored(const observer::Entry& entry);

/// Whether a channel is one of those.
bool is_mirror(std::string_view channel);

/// A message from such a channel as an entry; the error says why it is not one.
tl::expected<observer::Entry, std::string> entry_of(std::string_view channel,
                                                    std::string_view bytes);

}  // namespace millrace::fabric::lcm
