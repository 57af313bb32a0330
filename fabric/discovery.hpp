// Reads Cyclone's built-in topics: which request readers and reply writers there are, and whose.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fabric/entity.hpp"
#include "fabric/participant.hpp"
#include "fabric/registry.hpp"

namespace millrace::fabric {

class Discovery {
 public:
  /// `listener` is called in Cyclone's thread when there is something to drain.
  Discovery(const Participant& participant, const dds_listener_t* listener);

  struct News {
    /// Canonical UUIDs of the request readers that were seen, new or not.
    std::vector<std::string> uuids;
    /// Request readers that look like instances but are none, and why.
    std::vector<std::string> ignored;
  };
  /// Feeds the registry with what is new.
  News drain(Registry& registry);

 private:
  void drain_readers(Registry& registry, News& news);
  void drain_writers(Registry& registry);

  std::string fabric_;
  Entity readers_;
  Entity writers_;
};

}  // namespace millrace::fabric
