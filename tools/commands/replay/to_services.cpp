// millrace replay --to-services.
#include "tools/replay/to_services.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "fabric/dds/participant.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/caller/channel.hpp"
#include "tools/commands/replay/replay.hpp"
#include "tools/commands/replay/run.hpp"

namespace millrace::tools::commands::replay {

namespace {

namespace program = base::program;
using tools::replay::ReplayChannels;

constexpr std::size_t longest_machine = 63;

/// Channels that nobody else has, but for those the user has named.
ReplayChannels channels_asked(const Options& options, const tools::replay::Plan& plan) {
  const std::string prefix = caller::unique_machine("replay");
  ReplayChannels channels;
  std::map<fabric::ChannelKey, fabric::ChannelKey> taken_by;
  for (const tools::replay::PlannedCall& call : plan.calls) {
    if (channels.contains(call.channel)) {
      continue;
    }
    const auto named = options.channels.find(call.channel);
    const fabric::ChannelKey key = named.value_or(
        fabric::ChannelKey{prefix + "." + call.channel.machine, call.channel.channel});
    if (key.machine.size() > longest_machine) {
      throw program::UsageError(fmt::format(
          "the name {} is too long for the machine of replayed calls; name one that has at most {} "
          "characters, --channel {}=NAME",
          key.machine, longest_machine, call.channel.machine));
    }
    if (const auto [other, is_new] = taken_by.try_emplace(key, call.channel); !is_new) {
      throw program::UsageError(fmt::format("--channel: {} and {} cannot both be replayed in {}",
                                            other->second.to_string(), call.channel.to_string(),
                                            key.to_string()));
    }
    channels.emplace(call.channel, tools::replay::ReplayChannel{key, named.value_or(call.channel)});
  }
  return channels;
}

/// A channel that the user has named must not belong to a live machine.
void check_free(const Options& options, const ReplayChannels& channels) {
  if (options.channels.empty()) {
    return;
  }
  const bus::Live live = bus::take_snapshot(options.fabric.options());
  for (const auto& [recorded, channel] : channels) {
    if (const auto why = caller::why_taken(live, channel.key)) {
      throw program::UsageError(fmt::format("--channel: {}", *why));
    }
  }
}

}  // namespace

int to_services(const Options& options, const tools::replay::Plan& plan) {
  const ReplayChannels channels = channels_asked(options, plan);
  check_free(options, channels);
  fabric::dds::Participant participant(options.fabric.options());
  ReplayRun run(options, plan, tools::replay::Side::service);
  tools::replay::ToServices stage(participant, run.io().get_executor(), plan, channels, run);
  if (!run.wait_until_there([&] { return stage.missing(); })) {
    return program::exit_failed;
  }
  stage.play(options.play());
  return run.play(stage.player());
}

}  // namespace millrace::tools::commands::replay
