// Reads Cyclone's built-in topics: the request readers, reply writers and heartbeat writers, and
// their participants. Any participant can announce any endpoint: DDS Security checks its permission
// only when it matches the endpoint with one of ours.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fabric/dds/entity.hpp"
#include "fabric/dds/listeners.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/registry/instance_registry.hpp"
#include "fabric/wire/topics.hpp"

namespace millrace::fabric::endpoints {

class Discovery {
 public:
  enum class Of : std::uint8_t {
    /// An endpoint with calls: it reads replies and reports what was matched with it.
    calls,
    /// A tool without requests of its own. With trust it has a reader of replies that keeps none
    /// of them and is matched with each instance that may answer.
    tools
  };
  /// `wake`, if not null, is posted when there is something to drain, and outlives this.
  Discovery(const dds::Participant& participant, Of of, dds::PostOnce* wake);

  struct Ignored {
    /// The kind of mistake, and its endpoint: both limit the warnings.
    std::string kind;
    std::string about;
    Message reason;
  };
  struct News {
    /// Endpoints that look like an instance's but are rejected, and why.
    std::vector<Ignored> ignored;
  };
  /// Passes the news to the registry.
  News drain(registry::InstanceRegistry& registry, SteadyTime now);

 private:
  void drain_readers(registry::InstanceRegistry& registry, SteadyTime now, News& news);
  void drain_writers(registry::InstanceRegistry& registry, News& news);

  std::string fabric_;
  Of of_;
  /// With trust, of a tool: the reply writers that were matched. Before its reader.
  std::optional<dds::MatchQueue> matches_;
  dds::Entity replies_topic_;
  dds::Entity replies_subscriber_;
  dds::Entity replies_;
  dds::Entity readers_;
  dds::Entity writers_;
};

}  // namespace millrace::fabric::endpoints
