// millrace replay --to-services.
#include "tools/replay/to_services.hpp"

#include "base/program/command_line.hpp"
#include "fabric/dds/participant.hpp"
#include "tools/commands/replay/replay.hpp"
#include "tools/commands/replay/run.hpp"

namespace millrace::tools::commands::replay {

namespace {

namespace program = base::program;
using tools::replay::ReplayChannels;

ReplayChannels channels_of(const Options& options, const caller::Slot& slot,
                           const tools::replay::Plan& plan) {
  std::set<fabric::ChannelKey> recorded;
  for (const tools::replay::PlannedCall& call : plan.calls) {
    recorded.insert(call.channel);
  }
  const auto asked = channels_asked(options, slot, recorded);
  check_free(options, asked);
  ReplayChannels channels;
  for (const auto& [channel, key] : asked) {
    channels.emplace(channel, tools::replay::ReplayChannel{
                                  key, options.channels.find(channel).value_or(channel)});
  }
  return channels;
}

}  // namespace

int to_services(const Options& options, const tools::replay::Plan& plan) {
  fabric::dds::Participant participant(options.fabric.options());
  const caller::Slot slot("replay", participant.options());
  const ReplayChannels channels = channels_of(options, slot, plan);
  ReplayRun run(options, plan, tools::replay::Side::service);
  tools::replay::ToServices stage(participant, run.io().get_executor(), slot, plan, channels, run);
  if (!run.wait_until_there([&] { return stage.missing(); })) {
    return program::exit_failed;
  }
  stage.play(options.play());
  return run.play(stage.player());
}

}  // namespace millrace::tools::commands::replay
