// How states and events are called in the archive and its exports.
#pragma once

#include <string>

#include "fabric/messages.hpp"

namespace millrace::services::archiver {

/// "seen", "dispatched" …
std::string name_of(fabric::EventKind kind);
/// "idle", "running" …
std::string name_of(fabric::ChannelState state);

}  // namespace millrace::services::archiver
