// A link to a controller that is up, and what has been found out about the controller there.
//
//   auto way = std::make_shared<Way>(client, location);
//   auto known = co_await way->readings.look_up(1, {"V.E.LIMIT"});
#pragma once

#include <memory>
#include <utility>

#include "cnc/ads/client.hpp"
#include "cnc/variables/readings.hpp"

namespace millrace::gateway::live {

struct Way {
  explicit Way(std::shared_ptr<cnc::ads::Client> the_client,
               cnc::variables::Location the_location = {})
      : client(std::move(the_client)), location(the_location), readings(*client, location) {}

  std::shared_ptr<cnc::ads::Client> client;
  cnc::variables::Location location;
  cnc::variables::Readings readings;
};

}  // namespace millrace::gateway::live
