// The words for enumerators, in output and in `--json`.
#pragma once

#include <string_view>

#include "fabric/command.hpp"
#include "fabric/messages.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::print {

std::string_view name_of(fabric::ReplyKind kind);
std::string_view name_of(fabric::ServiceCode code);
std::string_view name_of(fabric::ChannelState state);
std::string_view name_of(fabric::EventKind kind);
std::string_view name_of(fabric::Delivery delivery);
std::string_view name_of(fabric::CommandKind kind);
std::string_view name_of(recording::Change change);

}  // namespace millrace::tools::print
