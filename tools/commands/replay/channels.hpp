// The channels of a replay.
#pragma once

#include <map>
#include <set>

#include "tools/commands/replay/options.hpp"

namespace millrace::tools::commands::replay {

/// The channel for each recorded one: from --channel, otherwise one of a machine with a random
/// name. Throws UsageError if two of them are the same, or a name is too long.
std::map<fabric::ChannelKey, fabric::ChannelKey> channels_asked(
    const Options& options, const std::set<fabric::ChannelKey>& recorded);

/// A channel that the user has named must not belong to a live machine: throws UsageError.
void check_free(const Options& options,
                const std::map<fabric::ChannelKey, fabric::ChannelKey>& channels);

}  // namespace millrace::tools::commands::replay
