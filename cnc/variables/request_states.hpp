// Reads REQUEST_STATE of many channels at once, which a gateway polls.
//
//   RequestStates states(client);
//   auto seen = co_await states.read({1, 2, 5});      // one request, one result for each
//
// The first read finds out whether the controller supports sums, as in service_interface.hpp.
#pragma once

#include <cstdint>
#include <vector>

#include "cnc/variables/channel.hpp"

namespace millrace::cnc::variables {

/// The client must outlive the pending requests.
class RequestStates {
 public:
  explicit RequestStates(ads::Client& client, Location location = {})
      : client_(client), location_(location) {}

  /// Results in the order of `channels`. An error of one channel is the error of its result; an
  /// error of the whole request (timeout, link_lost) is that of each.
  boost::asio::awaitable<std::vector<ads::Result<std::uint32_t>>> read(
      std::vector<std::uint16_t> channels);

  /// Call it on a new connection: forgets what was found out about the controller.
  void forget(Location location = {}) {
    location_ = location;
    sums_ = true;
  }

 private:
  using Answers = std::vector<ads::Result<Bytes>>;
  boost::asio::awaitable<ads::Result<Answers>> read_in_a_sum(
      const std::vector<std::uint16_t>& channels);

  ads::Client& client_;
  Location location_;
  bool sums_ = true;
};

}  // namespace millrace::cnc::variables
