// Which instances are ready for calls, from discovery and heartbeats. Pure: endpoints, matches,
// heartbeats and times in, changes out; each event costs only what it concerns.
//
//   registry.reader_seen(7, {identity, participant}, now);
//   registry.writer_seen(8, {identity.id, participant});
//   registry.matched(7, true);
//   registry.matched(8, true);
//   registry.changes().ready   // identity
//   registry.heartbeat(9, now);     // 9 is a writer of heartbeats of this participant
//   registry.on_time(now);     // who has been silent for too long is gone
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "base/recent.hpp"
#include "fabric/messages.hpp"
#include "fabric/moment.hpp"

namespace millrace::fabric::registry {

/// Cyclone's instance handle of a discovered endpoint or participant.
using EndpointHandle = std::uint64_t;

class InstanceRegistry {
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

  /// Far more endpoints of a kind than a fabric has. Further ones are ignored until they announce
  /// themselves again: a stranger can announce any number.
  static constexpr std::size_t most_endpoints = 16'384;

  enum class Seen : std::uint8_t {
    taken,
    /// Another process announced this instance before, and still runs: ids are random, so this one
    /// is mistaken or lies. It counts once the other one is gone.
    second,
    /// There are too many.
    full
  };
  /// A request reader with an identity; again when its identity changed.
  Seen reader_seen(EndpointHandle handle, Reader reader, SteadyTime now);
  /// A reply writer.
  Seen writer_seen(EndpointHandle handle, Writer writer);
  /// A writer of heartbeats, and its participant.
  void heartbeat_writer_seen(EndpointHandle handle, EndpointHandle participant);
  void endpoint_gone(EndpointHandle handle);
  /// An endpoint was matched with ours, or unmatched; it may not have been seen yet.
  void matched(EndpointHandle handle, bool is);
  /// For observers, which have nothing to match: every seen endpoint counts as matched.
  void match_all() { match_all_ = true; }

  /// From now on only instances of authenticated processes count.
  void require_authentication() { authentication_required_ = true; }
  /// The participant has proved to have a certificate of this name; nullopt: it was revoked.
  void authenticated(EndpointHandle participant, std::optional<std::string> name);
  /// The authenticated participant is gone; its last samples may still be untaken.
  void authenticated_gone(EndpointHandle participant);
  /// Instances whose processes proved no identity within authentication_timeout, with their UUIDs;
  /// each once.
  std::vector<std::pair<InstanceId, std::string>> take_unauthenticated() {
    return std::exchange(unauthenticated_, {});
  }
  /// The instances whose requests this participant reads.
  [[nodiscard]] std::vector<InstanceId> instances_of(EndpointHandle participant) const;
  /// A process announces its identity first, so DDS reports it before all other endpoints; another
  /// vendor's may come later.
  static constexpr std::chrono::seconds authentication_timeout{2};

  /// This writer sent a heartbeat. False if it belongs to no process with known instances. `busy`:
  /// it lists calls; nullopt: it lists no instances.
  bool heartbeat(EndpointHandle writer, SteadyTime now, std::optional<bool> busy = std::nullopt);
  /// A request was sent to this instance: its process should now send heartbeats as often as a busy
  /// one.
  void requested(const InstanceId& instance, SteadyTime now);
  /// The reader stood still for this time, so it could receive nothing.
  void stood_still(std::chrono::nanoseconds late);
  /// The same, for so long that samples of that time may still be on their way: each process gets
  /// its full time again before it counts as silent.
  void start_over(SteadyTime now);
  /// Takes silent instances for gone, until they send heartbeats again.
  void on_time(SteadyTime now);
  /// When on_time must be called.
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return check_at_; }

  /// Whether this writer may publish for `instance`: it is the instance's reply writer, of the
  /// process that reads its requests, if one is known. It may have left since; its earlier samples
  /// may still be untaken.
  [[nodiscard]] bool speaks_for(EndpointHandle writer, const InstanceId& instance) const;
  /// The same for a writer of heartbeats.
  [[nodiscard]] bool heartbeats_for(EndpointHandle writer, const InstanceId& instance) const;
  /// Of all present participants, this one announced the instance first.
  [[nodiscard]] bool is_home(EndpointHandle participant, const InstanceId& instance) const {
    return is_seen(instance) && home_of(instance) == participant;
  }
  /// The instance has a request reader.
  [[nodiscard]] bool is_seen(const InstanceId& instance) const {
    return readers_of_.contains(instance);
  }

  /// Instances without a request reader, since the last call.
  std::vector<InstanceId> take_vanished() { return std::exchange(vanished_, {}); }

  /// The changes since the last call. An instance is ready when a request reader and a reply writer
  /// of its id, both of the participant that announced it first, are matched, and that participant
  /// is not silent.
  Changes changes();

 private:
  /// A process, as far as it has instances or heartbeats.
  struct Process {
    /// 0: it sends no heartbeats.
    SteadyTime::duration lease{};
    SteadyTime::duration busy_lease{};
    SteadyTime heard_at{};
    /// Its last heartbeat listed calls.
    bool busy = false;
    /// The first request since its last heartbeat.
    std::optional<SteadyTime> requested_at{};
    bool silent = false;
    /// Its request readers.
    std::set<EndpointHandle> readers;
    /// Its reply writers and writers of heartbeats.
    std::size_t writers = 0;
    /// When the missing identity is reported; nullopt: it has one, or it was reported.
    std::optional<SteadyTime> reported_at{};
  };

  /// Far more writers than leave before their last samples are taken.
  static constexpr std::size_t most_departed = 256;

  [[nodiscard]] bool is_matched(EndpointHandle handle) const {
    return match_all_ || matched_.contains(handle);
  }
  [[nodiscard]] bool is_authenticated(EndpointHandle participant) const {
    return !authentication_required_ || names_.contains(participant);
  }
  [[nodiscard]] bool was_authenticated(EndpointHandle participant) const {
    return is_authenticated(participant) || gone_names_.contains(participant);
  }
  void report_unauthenticated(Process& process, SteadyTime now);
  [[nodiscard]] const InstanceIdentity* ready_now(const InstanceId& id) const;
  [[nodiscard]] bool can_answer(const InstanceId& id, EndpointHandle participant) const;
  [[nodiscard]] const Writer* writer_of(EndpointHandle handle) const;
  /// The present participant that announced the instance first; 0 if none.
  [[nodiscard]] EndpointHandle home_of(const InstanceId& id) const;
  [[nodiscard]] static SteadyTime silent_at(const Process& process);
  /// on_time must be called at `time`, if not before.
  void check_at(SteadyTime time) {
    check_at_ = std::min(check_at_.value_or(SteadyTime::max()), time);
  }
  void forget_reader(EndpointHandle handle);
  void forget_writer(EndpointHandle handle);
  void forget_process(EndpointHandle participant);
  void touch(EndpointHandle handle);
  void touch_all_of(const Process& process);

  std::unordered_map<EndpointHandle, Reader> readers_;
  std::unordered_map<EndpointHandle, Writer> writers_;
  std::unordered_map<EndpointHandle, EndpointHandle> heartbeat_writers_;
  /// By instance: where its requests are read, as they came, and where its replies are written.
  std::map<InstanceId, std::vector<EndpointHandle>> readers_of_;
  std::map<InstanceId, std::set<EndpointHandle>> writers_of_;
  /// By participant.
  std::map<EndpointHandle, Process> processes_;
  /// The writers that left last; handles are not used twice.
  base::Recent<EndpointHandle, Writer> departed_{most_departed};
  std::unordered_set<EndpointHandle> matched_;
  bool match_all_ = false;
  bool authentication_required_ = false;
  /// The proved name, by participant.
  std::map<EndpointHandle, std::string> names_;
  base::Recent<EndpointHandle> gone_names_{most_departed};
  std::vector<std::pair<InstanceId, std::string>> unauthenticated_;
  std::map<InstanceId, InstanceIdentity> announced_;
  /// Instances that may have changed since the last call of changes().
  std::set<InstanceId> touched_;
  std::vector<InstanceId> vanished_;
  std::optional<SteadyTime> check_at_;
};

}  // namespace millrace::fabric::registry
