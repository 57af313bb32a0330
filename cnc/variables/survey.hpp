// Finds out whether a controller has a Service Interface, and in how many channels.
//
//   auto found = co_await survey(client);
//   if (found && found->channels == 0) log->error("{}", found->finding);
#pragma once

#include "cnc/variables/channel.hpp"

namespace millrace::cnc::variables {

/// More channels than any controller has; limits the survey of a simulated device that accepts
/// every channel.
inline constexpr std::uint32_t max_channels = 32;

struct Survey {
  /// Channels 1 to this one have a Service Interface.
  std::uint32_t channels = 0;
  /// The result, as text for the operator.
  std::string finding;
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
