// REQUEST_STATE of many channels at once: what a gateway looks at all the time.
//
//   RequestStates states(client);
//   auto seen = co_await states.read({1, 2, 5});      // one request, one result for each
//
// Whether the controller knows sums is found by trying, as in service_interface.hpp.
#pragma once

#include <cstdint>
#include <vector>

#include "cnc/variables/channel.hpp"

namespace millrace::cnc::variables {

/// The client must outlive what is asked of it.
class RequestStates {
 public:
  explicit RequestStates(ads::Client& client, Location location = {})
      : client_(client), location_(location) {}

  /// In the order of `channels`. What a channel refuses is its own error; what becomes of the whole
  /// request (timeout, link_lost) is that of each.
  boost::asio::awaitable<std::vector<ads::Result<std::uint32_t>>> read(
      std::vector<std::uint16_t> channels);

  /// On a new link: forgets what was found out about the controller.
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
