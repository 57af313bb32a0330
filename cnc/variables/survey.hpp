// What a controller offers to a gateway: does it have a Service Interface, and in how many
// channels?
//
//   auto found = co_await survey(client);
//   if (found && found->channels == 0) log->error("{}", found->finding);
#pragma once

#include "cnc/variables/channel.hpp"

namespace millrace::cnc::variables {

/// More than any controller has; a simulated device that accepts every channel ends here.
inline constexpr std::uint32_t max_channels = 32;

struct Survey {
  /// Channels 1 to this one have a Service Interface.
  std::uint32_t channels = 0;
  /// What was found, in words for the operator.
  std::string finding;
};

/// Where the controller keeps the variables of this channel: at `first`, or in the index groups of
/// the other generation of controllers (inferred: both stand in the documentation). `first` if it
/// refuses both. An error as for survey().
boost::asio::awaitable<ads::Result<Location>> locate(ads::Client& client, std::uint32_t channel,
                                                     Location first = {});

/// Asks channel after channel until one is refused. An error means that the question could not be
/// put (no link, no answer in time, controller not ready): try again later. The client must outlive
/// the survey.
boost::asio::awaitable<ads::Result<Survey>> survey(ads::Client& client, Location location = {},
                                                   std::uint32_t limit = max_channels);

}  // namespace millrace::cnc::variables
