// Sends an operator's commands and waits for their outcomes.
//
//   const auto outcomes = issue(participant, commands, std::chrono::seconds(2), " --domain 7");
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/command.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/variables.hpp"

namespace millrace::tools::bus {

/// The outcome of a command, and the time since it was last sent.
struct CommandResult {
  fabric::Outcome outcome{};
  std::chrono::nanoseconds after{};
  /// When it arrived, by this host's clock.
  fabric::Time at{};
};

/// Repeats each command until its outcome arrives or `patience` is over; a receiver executes a
/// repeated command once. The result has the outcomes by the id of their command. `flags` are those
/// of the fabric, for suggested commands (fabric::profile::given_flags). Throws std::runtime_error
/// if the fabric cannot be used.
std::map<fabric::InstanceId, CommandResult> issue(fabric::dds::Participant& participant,
                                                  const std::vector<fabric::Command>& commands,
                                                  std::chrono::milliseconds patience,
                                                  const std::string& flags);

/// "user@host", for a command's issuer.
std::string issuer_here();

// Sends variable requests to gateways and waits for the reply.
//
//   VariableClient requester(participant, {"press", 1}, std::chrono::seconds(5), " --domain 7");
//   const auto reply = requester.ask({.names = {"V.E.LIMIT"}});
//   if (!reply) …                                // no gateway replied, and the probable reason

class VariableClient {
 public:
  /// `participant` must outlive it. Each request ends after `patience`, sooner if no gateway serves
  /// the machine. `flags` as for issue(). Throws std::runtime_error if the fabric cannot be used.
  VariableClient(fabric::dds::Participant& participant, fabric::ChannelKey key,
                 std::chrono::milliseconds patience, std::string flags);
  ~VariableClient();
  VariableClient(const VariableClient&) = delete;
  VariableClient& operator=(const VariableClient&) = delete;

  /// Sends action, names, values and first as given and sets the rest. Repeats the request until
  /// the reply; a gateway executes a repeated request once. The error is for people: what happened,
  /// and what to do.
  tl::expected<fabric::VariableReply, std::string> ask(fabric::VariableRequest request);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::tools::bus
