// millrace replay --as-cnc.
#include "tools/replay/as_cnc.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/ascii.hpp"
#include "tools/caller/caller.hpp"
#include "tools/commands/replay/replay.hpp"
#include "tools/commands/replay/run.hpp"

namespace millrace::tools::commands::replay {

namespace {

namespace program = base::program;
using tools::replay::Plan;

/// The number of the stand-in's channel for each recorded one.
std::map<fabric::ChannelKey, std::uint32_t> channels_played(const Options& options,
                                                            const Plan& plan) {
  std::map<fabric::ChannelKey, std::uint32_t> channels;
  std::map<std::uint32_t, fabric::ChannelKey> recorded_of;
  for (const tools::replay::PlannedCall& call : plan.calls) {
    const std::uint32_t number = options.channels.find(call.channel).value_or(call.channel).channel;
    channels.emplace(call.channel, number);
    const auto [other, is_new] = recorded_of.try_emplace(number, call.channel);
    if (number > cnc::simulator::max_channels) {
      throw program::UsageError(
          fmt::format("--as-cnc: a controller has no channel {}; name another "
                      "one for it, --channel {}=cnc/1",
                      number, call.channel.to_string()));
    }
    if (!is_new && other->second != call.channel) {
      throw program::UsageError(fmt::format(
          "--as-cnc: {0} and {1} would both be channel {2} of the one controller; choose "
          "one with --machine, or another channel for one of them, --channel {1}=cnc/{3}",
          other->second.to_string(), call.channel.to_string(), number, number + 1));
    }
  }
  return channels;
}

tools::replay::AsCncOptions settings_of(const Options& options) {
  tools::replay::AsCncOptions settings;
  const std::size_t colon = options.listen.rfind(':');
  const std::string_view port =
      std::string_view(options.listen).substr(colon == std::string::npos ? 0 : colon + 1);
  const auto number = base::text::parse_number<std::uint16_t>(port);
  if (colon == std::string::npos || colon == 0 || !number) {
    throw program::UsageError(
        fmt::format("--listen {}: expected ADDRESS:PORT, as in 127.0.0.1:48898", options.listen));
  }
  settings.address = options.listen.substr(0, colon);
  settings.tcp_port = *number;
  const auto net_id = cnc::ads::NetId::parse(options.net_id);
  if (!net_id) {
    throw program::UsageError(
        fmt::format("--net-id {}: expected six numbers, as in 127.0.0.1.1.1", options.net_id));
  }
  settings.net_id = *net_id;
  return settings;
}

/// Follows which services are there, and calls none.
struct ServiceFollower : caller::CallerListener {
  void on_ended(const caller::Ended&) override {}
};

}  // namespace

int as_cnc(const Options& options, const Plan& plan) {
  const auto channels = channels_played(options, plan);
  const tools::replay::AsCncOptions settings = settings_of(options);
  ReplayRun run(options, plan, tools::replay::Side::program);
  tools::replay::AsCnc stage(run.io().get_executor(), plan, channels, settings, run,
                             program::make_log("replay"));
  const std::string what = fmt::format("acting as a CNC on {}:{}, NetId {}", settings.address,
                                       stage.tcp_port(), settings.net_id.to_string());
  // Standard output is for JSON then.
  if (options.json) {
    fmt::print(stderr, "ready: {}\n", what);
  } else {
    program::ready(what);
  }

  ServiceFollower onlooker;
  const fabric::dds::ParticipantOptions join = options.fabric.options();
  fabric::dds::Participant participant(join);
  const caller::Slot slot("replay", join);
  const caller::Caller registry(participant, run.io().get_executor(), onlooker, slot);
  const auto missing = [&] {
    std::vector<std::string> names;
    for (const std::uint32_t channel : stage.unseen()) {
      names.push_back(fmt::format("a gateway that serves channel {} of this controller", channel));
    }
    for (const auto& [uuid, channel] : tools::replay::needs_of(plan)) {
      if (const auto why =
              registry.why_unserved(uuid, options.channels.find(channel).value_or(channel))) {
        names.push_back(*why);
      }
    }
    return names;
  };
  if (!run.wait_until_there(missing)) {
    return program::exit_failed;
  }
  stage.play(options.play());
  return run.play(stage.player());
}

}  // namespace millrace::tools::commands::replay
