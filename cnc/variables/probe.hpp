// What a controller offers to a gateway, each with its answer, before one is configured for it.
//
//   const Probe found = co_await probe(client, symbol);       // of a client that is connected
//   for (const Answer& one : found.answers) …
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cnc/variables/channel.hpp"

namespace millrace::cnc::variables {

/// What the lack of something means for a gateway.
enum class Verdict : std::uint8_t {
  there,
  /// Not there, and a gateway does without it.
  optional,
  /// Not there, and no gateway can serve the controller.
  missing
};

struct Answer {
  /// "AMS port 552 (SDA)"
  std::string what;
  /// In words, with its code; texts of the controller are in CP1252.
  std::string answer;
  Verdict verdict = Verdict::there;
};

struct Probe {
  std::vector<Answer> answers;
  /// Channels 1 to this one have a Service Interface.
  std::uint32_t channels = 0;
};

/// Asks for the tasks of the CNC, the Service Interface of each channel, sum commands and
/// notifications, and leaves nothing behind. Writes nothing. `symbol` is how the controller calls a
/// channel's variable (state_notices.hpp). The client must outlive the probe.
boost::asio::awaitable<Probe> probe(ads::Client& client, std::string symbol);

}  // namespace millrace::cnc::variables
