// Sends an operator's commands and waits for their outcomes.
//
//   const auto heard = issue(participant, commands, std::chrono::seconds(2));
#pragma once

#include <chrono>
#include <map>
#include <vector>

#include "fabric/command.hpp"
#include "fabric/dds/participant.hpp"

namespace millrace::tools::bus {

/// The outcome of a command, and the time since it was last sent.
struct CommandResult {
  fabric::Outcome outcome{};
  std::chrono::nanoseconds after{};
  /// When it arrived, by this host's clock.
  fabric::Time at{};
};

/// Repeats each command until its outcome arrives or `patience` is over; a receiver executes a
/// repeated command once. The result has the outcomes by the id of their command. Throws
/// std::runtime_error if the fabric cannot be used.
std::map<fabric::InstanceId, CommandResult> issue(fabric::dds::Participant& participant,
                                                  const std::vector<fabric::Command>& commands,
                                                  std::chrono::milliseconds patience);

/// "user@host", for a command's issuer.
std::string issuer_here();

}  // namespace millrace::tools::bus
