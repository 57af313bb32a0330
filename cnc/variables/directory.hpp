// The directory of the task COM, read from the controller
// (IB/tf5200_ads_access_to_cnc/855973643, documented).
#pragma once

#include <vector>

#include "cnc/ads/client.hpp"
#include "cnc/variables/objects.hpp"

namespace millrace::cnc::variables {

/// All records of a channel's directory; that of channel 1 has the controller's objects, too. An
/// error is the controller's or the client's, protocol_error for a directory of more than 10,000.
boost::asio::awaitable<ads::Result<std::vector<DirectoryEntry>>> read_directory(
    ads::Client& client, std::uint32_t channel);

}  // namespace millrace::cnc::variables
