// Who is ready to take calls, worked out from what discovery shows. Pure: endpoints and matches in,
// changes out.
//
//   registry.reader_seen(7, {identity, participant});
//   registry.writer_seen(8, {identity.id, participant});
//   registry.set_matched({7, 8});
//   registry.changes().ready   // identity
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "fabric/messages.hpp"

namespace millrace::fabric::registry {

/// Cyclone's instance handle of a discovered endpoint or participant.
using EndpointHandle = std::uint64_t;

class Registry {
 public:
  struct Reader {
    InstanceIdentity identity;
    EndpointHandle participant = 0;
  };
  struct Writer {
    InstanceId instance;
    EndpointHandle participant = 0;
  };
  struct Changes {
    std::vector<InstanceIdentity> ready;
    std::vector<InstanceIdentity> changed;
    std::vector<InstanceId> gone;
  };

  /// A request reader with an identity; again when its identity changed.
  void reader_seen(EndpointHandle handle, Reader reader);
  /// A reply writer.
  void writer_seen(EndpointHandle handle, Writer writer);
  void endpoint_gone(EndpointHandle handle);
  /// The endpoints that are matched with ours at the moment.
  void set_matched(std::set<EndpointHandle> handles);
  /// For who only watches and has nothing to match: every endpoint that is seen counts as matched.
  void match_all() { match_all_ = true; }

  /// What is different since the last call. An instance is ready when a request reader and a reply
  /// writer of its id, both of one participant, are matched.
  Changes changes();

 private:
  [[nodiscard]] std::map<InstanceId, InstanceIdentity> ready_now() const;
  [[nodiscard]] bool is_matched(EndpointHandle handle) const {
    return match_all_ || matched_.contains(handle);
  }

  std::map<EndpointHandle, Reader> readers_;
  std::map<EndpointHandle, Writer> writers_;
  std::set<EndpointHandle> matched_;
  bool match_all_ = false;
  std::map<InstanceId, InstanceIdentity> announced_;
};

}  // namespace millrace::fabric::registry
