// Finds out what a controller offers to a gateway, before a gateway is configured for it.
//
//   const Probe found = co_await probe(client, symbol);       // of a client that is connected
//   for (const Answer& one : found.answers) …
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cnc/variables/channel.hpp"

namespace millrace::cnc::variables {

/// What a result means for a gateway.
enum class Verdict : std::uint8_t {
  there,
  /// Missing; a gateway can work without it.
  optional,
  /// Missing; a gateway cannot serve the controller.
  missing
};

struct Answer {
  /// For example "AMS port 552 (SDA)".
  std::string what;
  /// As text, with its code; texts of the controller are in CP1252.
  std::string answer;
  Verdict verdict = Verdict::there;
};

struct Probe {
  std::vector<Answer> answers;
  /// Channels 1 to this one have a Service Interface.
  std::uint32_t channels = 0;
};

/// Checks the tasks of the CNC, the Service Interface of each channel, sum commands and
/// notifications. Writes no variable and leaves no handle behind. `symbol` is the pattern of the
/// symbol names of a channel's variables (state_subscriptions.hpp). The client must outlive the
/// probe.
boost::asio::awaitable<Probe> probe(ads::Client& client, std::string symbol);

// Finds out whether a controller has a Service Interface, and in how many channels.
//
//   auto found = co_await survey(client);
//   if (found && found->channels == 0) log->error("{}", found->finding);

/// More channels than any controller has; limits the survey of a simulated device that accepts
/// every channel.
inline constexpr std::uint32_t max_channels = 32;

struct Survey {
  /// Channels 1 to this one have a Service Interface.
  std::uint32_t channels = 0;
  /// The result, for the operator.
  base::messages::Message finding;
};

/// The address of this channel's variables: `first`, or the index groups of the other generation of
/// controllers (inferred: both are in the documentation). `first` if the controller refuses both.
/// Errors as for survey().
boost::asio::awaitable<ads::Result<Location>> locate(ads::Client& client, std::uint32_t channel,
                                                     Location first = {});

/// Reads channel after channel until one is refused. An error means that no answer was possible (no
/// connection, timeout, controller not ready): try again later. The client must outlive the survey.
boost::asio::awaitable<ads::Result<Survey>> survey(ads::Client& client, Location location = {},
                                                   std::uint32_t limit = max_channels);

}  // namespace millrace::cnc::variables
