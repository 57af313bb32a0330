// Sends the core's value requests to a controller.
#pragma once

#include <memory>

#include <boost/asio/awaitable.hpp>

#include "cnc/ads/client.hpp"
#include "cnc/variables/readings.hpp"
#include "gateway/machines/controller.hpp"

namespace millrace::gateway::shell {

/// An open connection for value requests: it stores what was found out about the controller for the
/// next request.
struct ValueSource {
  ValueSource(cnc::ads::Client& the_client, cnc::variables::Location the_location)
      : client(the_client), location(the_location), readings(client, location) {}
  cnc::ads::Client& client;
  cnc::variables::Location location;
  cnc::variables::Readings readings;
};

/// One request of a source at a time; its client must outlive it.
boost::asio::awaitable<machines::Answer> ask_values(std::shared_ptr<ValueSource> source,
                                                    machines::Question question);

}  // namespace millrace::gateway::shell
