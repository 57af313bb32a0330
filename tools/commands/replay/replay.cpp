#include "tools/commands/replay/replay.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "fabric/channel_scope.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/caller/caller.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/commands/recordings/recordings.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::commands::replay {

namespace {

using base::program::UsageError;

template <typename Take>
void for_each_text(CLI::App& command, const std::string& name, const std::string& type,
                   const std::string& description, Take take) {
  command
      .add_option_function<std::vector<std::string>>(
          name,
          [take](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              if (const auto taken = take(text); !taken) {
                throw CLI::ValidationError(taken.error());
              }
            }
          },
          description)
      ->type_name(type)
      ->allow_extra_args(false);
}

/// "N" or "A=B".
tl::expected<void, std::string> take_channel(Options& options, const std::string& text) {
  if (text.find('=') != std::string::npos) {
    return options.channels.add(text);
  }
  std::uint16_t number = 0;
  if (!CLI::detail::lexical_cast(text, number) || number == 0) {
    return tl::unexpected("'" + text +
                          "' is not a channel; expected a number, or a mapping as in cnc/1=test/7");
  }
  options.filter.channels.insert(number);
  return {};
}

void add_ways(CLI::App& command, Options& options) {
  command.add_flag("--to-services", options.to_services,
                   "Send the recorded requests to live services");
  command.add_flag("--as-service", options.as_service, "Answer live calls from the recording");
  command.add_flag("--as-cnc", options.as_cnc,
                   "Act as the controller: a gateway finds the recorded requests there");
  command.add_flag("--data", options.data,
                   "Send the recorded machine data and events of NC programs, marked as replayed");
}

void add_times(CLI::App& command, Options& options) {
  command.add_option("--rate", options.rate, "Speed: 2 = twice as fast as recorded")
      ->check(base::program::positive_number())
      ->capture_default_str();
  command.add_flag("--fast", options.fast,
                   "Without waiting; calls that ran one after the other still run so");
  command.add_flag("--step", options.step, "One call after the other, each when you press Enter");
  command.add_option("--loop", options.rounds, "Play it N times; 0 = until interrupted")
      ->type_name("N")
      ->capture_default_str();
  add_duration(command, "--max-gap", options.max_gap,
               "Shorten longer times without a request to this");
  add_duration(
      command, "--wait", options.wait,
      "Wait this time for the services, before the first call; default 10s, 0 = start at once");
  add_duration(command, "--timeout", options.timeout, "Longest time for a response; default 30s");
}

void add_choice(CLI::App& command, Options& options) {
  add_machine_filter(command, options.filter);
  for_each_text(command, "--channel", "N|A=B",
                "Only this channel, or B in place of the recorded channel A (cnc/1=test/7, or "
                "cnc=test for a machine); may be given several times",
                [&options](const std::string& text) { return take_channel(options, text); });
  add_uuid_filter(command, options.filter);
  add_time_filter(command, options.filter);
}

void add_verification(CLI::App& command, Options& options) {
  command.add_flag("--verify", options.verify,
                   "Compare every response with the recorded one; exit code 1 if any differs");
  for_each_text(command, "--tolerance", "[UUID=]X[%]",
                "With --verify: tolerance of numbers, absolute or in per cent of the recorded "
                "number; may be repeated",
                [&options](const std::string& text) { return options.tolerances.add(text); });
}

}  // namespace

Options::Options(CLI::App& command) : fabric(command, {.name = "millrace replay"}) {
  recordings::add_file(command, file);
  add_ways(command, *this);
  add_times(command, *this);
  add_choice(command, *this);
  add_verification(command, *this);
  command
      .add_option("--error-state", error_state,
                  "With --as-service: RESPONSE_STATE for a call that was not recorded")
      ->check(base::program::positive_number())
      ->capture_default_str();
  command.add_option("--listen", listen, "With --as-cnc: address and TCP port of the ADS server")
      ->capture_default_str();
  command.add_option("--net-id", net_id, "With --as-cnc: the AMS NetId")->capture_default_str();
  add_json(command, json);
}

tools::replay::Pace Options::pace() const {
  using tools::replay::Timing;
  return {.timing = fast ? Timing::fast : step ? Timing::step : Timing::timed, .rate = rate};
}

void check(const Options& options) {
  const std::array<bool, 4> ways{options.to_services, options.as_service, options.as_cnc,
                                 options.data};
  if (std::ranges::count(ways, true) != 1) {
    throw UsageError("expected one of --to-services, --as-service, --as-cnc and --data");
  }
  if ((options.fast ? 1 : 0) + (options.step ? 1 : 0) + (options.rate != 1 ? 1 : 0) > 1) {
    throw UsageError("--rate, --fast and --step exclude each other");
  }
  if (options.as_service && options.step) {
    throw UsageError("--step: with --as-service the live calls decide when to answer");
  }
  if (options.data && options.step) {
    throw UsageError("--step is for calls; with --data use --rate");
  }
  if (options.data && options.verify) {
    throw UsageError("--verify: data has no responses to compare");
  }
  if (options.timeout.count() <= 0) {
    throw UsageError("--timeout: expected more than 0");
  }
}

namespace {

namespace program = base::program;
using tools::replay::Plan;

void report_skipped(const Plan& plan) {
  constexpr std::size_t most = 5;
  for (std::size_t i = 0; i < plan.skipped.size() && i < most; ++i) {
    const tools::replay::Skipped& skipped = plan.skipped[i];
    fmt::print(stderr, "millrace: call {} of {} is omitted: {}\n", skipped.recorded.to_string(),
               skipped.channel.to_string(), skipped.reason);
  }
  if (plan.skipped.size() > most) {
    fmt::print(stderr, "millrace: and {} more\n", plan.skipped.size() - most);
  }
}

int replay(const Options& options) {
  check(options);
  if (options.data) {
    return data(options);
  }
  mcap::FileSource source = recordings::open(options.file);
  tools::replay::PlanBuilder builder(options.filter);
  const auto read = recording::read_entries(
      source, {}, [&](const recording::Entry& entry) { builder.add(entry); });
  const Plan plan = builder.build({.max_gap = options.max_gap});
  report_skipped(plan);
  if (plan.calls.empty()) {
    recordings::report(options.file, read.problems, read.has_read);
    throw program::UsageError(fmt::format(
        "{} has no call to replay{}; 'millrace recording cat --kind request' lists what it has",
        options.file.string(), plan.skipped.empty() ? " that passes the filters" : ""));
  }
  const int result = options.to_services  ? to_services(options, plan)
                     : options.as_service ? as_service(options, plan)
                                          : as_cnc(options, plan);
  return std::max(result, recordings::report(options.file, read.problems, read.has_read));
}

}  // namespace

void add_replay(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "replay",
      "Replay a recording: its calls to services, as a service, as a controller; its machine data",
      "millrace replay --to-services --verify run.mcap\n"
      "  millrace replay --as-service --channel cnc=test run.mcap\n"
      "  millrace replay --as-cnc --rate 10 run.mcap\n"
      "  millrace replay --data --channel cnc=test run.mcap");
  auto options = std::make_shared<Options>(command);
  run_if_chosen(command, chosen, options, replay);
}

namespace {

using Channels = std::map<fabric::ChannelKey, fabric::ChannelKey>;

}  // namespace

Channels channels_asked(const Options& options, const caller::Slot& slot,
                        const std::set<fabric::ChannelKey>& recorded) {
  Channels channels;
  std::map<fabric::ChannelKey, fabric::ChannelKey> taken_by;
  for (const fabric::ChannelKey& channel : recorded) {
    const fabric::ChannelKey key = options.channels.find(channel).value_or(
        fabric::ChannelKey{slot.machine() + "." + channel.machine, channel.channel});
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
  const fabric::plant::Plant live = bus::take_snapshot(options.fabric.options());
  for (const auto& [recorded, channel] : channels) {
    if (const auto why = caller::reason_taken(live, channel)) {
      throw UsageError(fmt::format("--channel: {}", *why));
    }
  }
}

}  // namespace millrace::tools::commands::replay
