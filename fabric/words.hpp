// The word for each enumerator of the fabric: on command lines, in output and logs, in identities,
// in archives.
#pragma once

#include <optional>
#include <string_view>

#include "fabric/command.hpp"
#include "fabric/messages.hpp"

namespace millrace::fabric {

/// The word for a code of a later version: "unknown (200)". It lives as long as the process.
std::string_view unknown_word(std::uint8_t number);

/// "interim", "final"; like the others "unknown (200)" for a code of a later version.
std::string_view name_of(ReplyKind kind);
/// "ok", "failed", "repeated", "refused".
std::string_view name_of(ServiceCode code);
/// "at-least-once", "at-most-once".
std::string_view name_of(Delivery delivery);
std::string_view name_of(CompletionSignal completion_signal);
/// "link down", "idle", "running" …
std::string_view name_of(ChannelState state);
std::string_view name_of(JournalState state);
std::string_view name_of(WatchMode mode);
/// "seen", "dispatched" …
std::string_view name_of(EventKind kind);
/// "answer", "retry", "drain", "ping".
std::string_view name_of(CommandKind kind);

/// The other way; nothing for another word.
std::optional<Delivery> parse_delivery(std::string_view word);
std::optional<CompletionSignal> parse_completion_signal(std::string_view word);

}  // namespace millrace::fabric
