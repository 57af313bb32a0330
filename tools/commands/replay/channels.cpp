#include "tools/commands/replay/channels.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "fabric/channel_scope.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/caller/channel.hpp"

namespace millrace::tools::commands::replay {

namespace {

using base::program::UsageError;
using Channels = std::map<fabric::ChannelKey, fabric::ChannelKey>;

}  // namespace

Channels channels_asked(const Options& options, const std::set<fabric::ChannelKey>& recorded) {
  const std::string prefix = caller::unique_machine("replay");
  Channels channels;
  std::map<fabric::ChannelKey, fabric::ChannelKey> taken_by;
  for (const fabric::ChannelKey& channel : recorded) {
    const fabric::ChannelKey key = options.channels.find(channel).value_or(
        fabric::ChannelKey{prefix + "." + channel.machine, channel.channel});
    if (key.machine.size() > fabric::longest_machine_name) {
      throw UsageError(fmt::format(
          "the name {} is too long for the machine of a replay; name one that has at most {} "
          "characters, --channel {}=NAME",
          key.machine, fabric::longest_machine_name, channel.machine));
    }
    if (const auto [other, is_new] = taken_by.try_emplace(key, channel); !is_new) {
      throw UsageError(fmt::format("--channel: {} and {} cannot both be replayed in {}",
                                   other->second.to_string(), channel.to_string(),
                                   key.to_string()));
    }
    channels.emplace(channel, key);
  }
  return channels;
}

void check_free(const Options& options, const Channels& channels) {
  if (options.channels.empty()) {
    return;
  }
  const bus::FabricModel live = bus::take_snapshot(options.fabric.options());
  for (const auto& [recorded, channel] : channels) {
    if (const auto why = caller::reason_taken(live, channel)) {
      throw UsageError(fmt::format("--channel: {}", *why));
    }
  }
}

}  // namespace millrace::tools::commands::replay
