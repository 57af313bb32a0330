// Subcommands with which an operator acts: `call`, `ping`, `health`, `drain`, `answer`, `retry`.
// One source file each.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include <boost/json/array.hpp>

#include "fabric/profile/command_line.hpp"
#include "tools/bus/fabric_model.hpp"
#include "tools/bus/operator.hpp"
#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::operate {

void add_call(CLI::App& app, Chosen& chosen);
void add_ping(CLI::App& app, Chosen& chosen);
void add_health(CLI::App& app, Chosen& chosen);
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

/// Sends a command to each of these. Prints what each says, or adds it to `out` for --json, in
/// their order. True if all of them answer and do it.
bool tell_each(const OperateOptions& options, fabric::CommandKind kind,
               const std::vector<fabric::InstanceIdentity>& instances, boost::json::array& out);

/// Sends a command to each instance that `what` names (its UUID, id or name) and prints the
/// outcomes. Fails if there is none, or one does not respond or refuses.
int tell_instances(const OperateOptions& options, const bus::FabricModel& live,
                   fabric::CommandKind kind, const std::string& what);

/// Adds the argument CHANNEL, as in "cnc/1".
void add_channel_key(CLI::App& command, fabric::ChannelKey& key);

/// Sends a command about the pending call of `key` and prints the gateway's word. Fails if nothing
/// is pending there, or the gateway does not answer or refuses.
int tell_gateway(const OperateOptions& options, const fabric::ChannelKey& key,
                 fabric::Command command);

}  // namespace millrace::tools::commands::operate
