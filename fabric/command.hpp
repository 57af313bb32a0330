// What an operator may command gateways and instances to do, and the outcome.
#pragma once

#include <cstdint>
#include <string>

#include "fabric/messages.hpp"

namespace millrace::fabric {

enum class CommandKind : std::uint8_t {
  /// Answer the pending call of a channel instead of the service.
  answer,
  /// Dispatch the pending call of a channel again.
  retry,
  /// Finish the running calls, accept no new ones, leave.
  drain,
  /// Confirm that you run.
  ping
};

struct Command {
  /// A random id for each command. A receiver that gets it twice executes it once.
  InstanceId id{};
  CommandKind kind = CommandKind::answer;
  /// answer, retry, ping: only the gateway that serves this channel acts.
  ChannelKey key{};
  /// answer, retry: refused if the channel has another call.
  CallId call{};
  /// answer: at most 127 bytes, state not 0.
  std::string text{};
  std::uint32_t state = 0;
  /// drain, ping: only this instance acts; ping: or only the gateway of this id (MachineStatus).
  InstanceId instance{};
  /// "user@host", for logs and recordings.
  std::string issuer{};
  Time at{};
  Extras extras{};
  bool operator==(const Command&) const = default;
};
MILLRACE_FIELDS(Command, (id, .json = "command", .proto = "token", .on_wire = false),
                (kind, .json = "what"), key, call, (text, .cp1252 = true, .most = max_text), state,
                instance, issuer, at, (extras, .sparse = true))

struct Outcome {
  /// Drawn when a gateway starts; an instance uses its own id.
  InstanceId responder{};
  InstanceId command{};
  bool done = false;
  /// What was done, or why it was not done.
  Message detail{};
  Time at{};
  Extras extras{};
  bool operator==(const Outcome&) const = default;
};
MILLRACE_FIELDS(Outcome, responder, (command, .proto = "token", .on_wire = false), done, detail, at,
                (extras, .sparse = true))

}  // namespace millrace::fabric
