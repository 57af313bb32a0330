// In which channel a tool may call: never in one that belongs to somebody.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "fabric/messages.hpp"
#include "tools/bus/fabric_model.hpp"

namespace millrace::tools::caller {

/// "call.5f3a9c01": the name of a machine that nobody else has.
std::string unique_machine(std::string_view prefix);

/// Why a call in this channel would disturb a live one: a gateway serves its machine. Nothing if it
/// is free.
std::optional<std::string> reason_taken(const bus::FabricModel& live,
                                        const fabric::ChannelKey& key);

}  // namespace millrace::tools::caller
