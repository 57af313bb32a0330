// Subcommands with which an operator acts: `call`, `drain`, `answer`, `retry`.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <boost/json/array.hpp>

#include "fabric/plant/plant.hpp"
#include "fabric/profile/command_line.hpp"
#include "tools/bus/operator.hpp"
#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::operate {

void add_call(CLI::App& app, Chosen& chosen);
void add_drain(CLI::App& app, Chosen& chosen);
void add_answer(CLI::App& app, Chosen& chosen);
void add_retry(CLI::App& app, Chosen& chosen);

/// The common options of these subcommands: fabric, waiting time, output format.
struct OperateOptions {
  explicit OperateOptions(CLI::App& command);

  fabric::profile::FabricFlags fabric;
  std::chrono::nanoseconds timeout = std::chrono::seconds(2);
  bool json = false;
};

/// A command from here, now.
fabric::Command new_command(fabric::CommandKind kind);

using Instances = std::vector<fabric::InstanceIdentity>;
/// What each of some instances says, in their order; none where it does not answer.
using Answers = std::vector<std::optional<bus::CommandResult>>;

/// Sends a command to each of these and waits for `patience`.
Answers send_to_each(const fabric::profile::FabricFlags& fabric, std::chrono::nanoseconds patience,
                     fabric::CommandKind kind, const Instances& instances);
/// Never empty: a gateway has nothing to say about a call that an instance has again.
std::string result_text(fabric::CommandKind kind, const fabric::Outcome& outcome);
/// It has answered and done it.
bool is_done(const std::optional<bus::CommandResult>& answer);
/// A line for each.
std::string answers_text(const Instances& instances, const Answers& answers);
boost::json::array json_of(const Instances& instances, const Answers& answers);

/// Adds the argument CHANNEL, as in "cnc/1".
void add_channel_key(CLI::App& command, fabric::ChannelKey& key);

/// Sends a command about the pending call of `key` and prints the gateway's outcome. Fails if
/// nothing is pending there, or the gateway does not respond or refuses.
int tell_gateway(const OperateOptions& options, const fabric::ChannelKey& key,
                 fabric::Command command);

}  // namespace millrace::tools::commands::operate
