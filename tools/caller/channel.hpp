// The channel of a tool's calls: never one that a gateway owns.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "fabric/messages.hpp"
#include "tools/bus/fabric_model.hpp"

namespace millrace::tools::caller {

/// "call.5f3a9c01": a unique machine name.
std::string unique_machine(std::string_view prefix);

/// Why a call in this channel would disturb a real one: a gateway serves its machine. Nullopt if it
/// is free.
std::optional<std::string> reason_taken(const bus::FabricModel& live,
                                        const fabric::ChannelKey& key);

}  // namespace millrace::tools::caller
