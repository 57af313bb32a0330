// A link to a controller that is up, and what has been found out about the controller there.
//
//   auto way = std::make_shared<Way>(client, location);
//   auto known = co_await way->readings.look_up(1, {"V.E.LIMIT"});
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "cnc/ads/client.hpp"
#include "cnc/variables/readings.hpp"

namespace millrace::gateway::live {

struct Way {
  explicit Way(std::shared_ptr<cnc::ads::Client> the_client,
               cnc::variables::Location the_location = {})
      : client(std::move(the_client)),
        location(the_location),
        readings(*client, location),
        never_answered(unanswered()) {}

  /// A request of the link waits for its answer; whoever asks has none under way himself.
  [[nodiscard]] bool calls_wait() const { return unanswered() > never_answered; }

  std::shared_ptr<cnc::ads::Client> client;
  cnc::variables::Location location;
  cnc::variables::Readings readings;

 private:
  [[nodiscard]] std::uint64_t unanswered() const {
    const auto& counters = client->counters();
    return counters.requests - counters.answered - counters.timeouts;
  }

  /// Requests of the client's life that were lost with earlier links.
  std::uint64_t never_answered = 0;
};

}  // namespace millrace::gateway::live
