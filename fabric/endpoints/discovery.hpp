// Reads Cyclone's built-in topics: the request readers, reply writers and heartbeat writers, and
// their participants.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "fabric/dds/entity.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/registry/instance_registry.hpp"
#include "fabric/wire/topics.hpp"

namespace millrace::fabric::endpoints {

class Discovery {
 public:
  /// `listener` is called in Cyclone's thread when there is something to drain.
  Discovery(const dds::Participant& participant, const dds_listener_t* listener);

  struct Ignored {
    /// The kind of mistake, and its endpoint: both limit the warnings.
    std::string kind;
    std::string about;
    std::string reason;
  };
  struct News {
    /// The partitions of all seen request readers, new or not.
    std::vector<wire::RequestPartition> request_partitions;
    /// Endpoints that look like an instance's but are rejected, and why.
    std::vector<Ignored> ignored;
  };
  /// Passes the news to the registry.
  News drain(registry::InstanceRegistry& registry, SteadyTime now);

 private:
  void drain_readers(registry::InstanceRegistry& registry, SteadyTime now, News& news);
  void drain_writers(registry::InstanceRegistry& registry, News& news);

  std::string fabric_;
  dds::Entity readers_;
  dds::Entity writers_;
};

}  // namespace millrace::fabric::endpoints
