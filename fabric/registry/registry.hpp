// Who is ready to take calls, worked out from what discovery shows. Pure: endpoints and matches in,
// changes out.
//
//   registry.reader_seen(7, {identity, participant});
//   registry.writer_seen(8, {identity.id, participant});
//   registry.set_matched({7, 8});
//   registry.changes().ready   // identity
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <utility>
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

  /// Whether what this writer says is the word of `instance`: it is that instance's reply writer,
  /// of the process that reads its requests, if one is known to. It may have left meanwhile; what
  /// it had said before may still be untaken.
  [[nodiscard]] bool speaks_for(EndpointHandle writer, const InstanceId& instance) const;

  /// What is different since the last call. An instance is ready when a request reader and a reply
  /// writer of its id, both of one participant, are matched.
  Changes changes();

 private:
  [[nodiscard]] std::map<InstanceId, InstanceIdentity> ready_now() const;
  [[nodiscard]] bool is_matched(EndpointHandle handle) const {
    return match_all_ || matched_.contains(handle);
  }

  /// Far more writers than leave before their last words are taken.
  static constexpr std::size_t most_departed = 256;

  void forget_reader(EndpointHandle handle);
  [[nodiscard]] const Writer* writer_of(EndpointHandle handle) const;

  std::map<EndpointHandle, Reader> readers_;
  std::map<EndpointHandle, Writer> writers_;
  /// Where requests are read in the name of an instance: the reader and its participant.
  std::map<InstanceId, std::map<EndpointHandle, EndpointHandle>> homes_;
  /// The writers that left last; handles are not used twice.
  std::deque<std::pair<EndpointHandle, Writer>> departed_;
  std::set<EndpointHandle> matched_;
  bool match_all_ = false;
  std::map<InstanceId, InstanceIdentity> announced_;
};

}  // namespace millrace::fabric::registry
