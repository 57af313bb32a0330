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

}  // namespace millrace::cnc::variables
