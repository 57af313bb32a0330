// Reads the directory of the task COM from the controller (IB/tf5200_ads_access_to_cnc/855973643,
// documented).
#pragma once

#include <vector>

#include "cnc/ads/client.hpp"
#include "cnc/variables/objects.hpp"

namespace millrace::cnc::variables {

/// All records of a channel's directory; the directory of channel 1 also has the controller's
/// objects. Errors are those of the controller or the client, and protocol_error for a directory of
/// more than 10,000 records.
boost::asio::awaitable<ads::Result<std::vector<DirectoryEntry>>> read_directory(
    ads::Client& client, std::uint32_t channel);

}  // namespace millrace::cnc::variables
