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
#include <string>
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
    /// The instance id names this participant as its maker (fabric/dds/made_id.hpp).
    bool made_id = false;
  };
  struct Writer {
    InstanceId instance;
    EndpointHandle participant = 0;
    /// Of its partition. DDS has checked that the participant may answer for it, if it is matched.
    std::string uuid{};
  };
  struct Changes {
    std::vector<InstanceIdentity> ready;
    std::vector<InstanceIdentity> changed;
    /// They get no calls any more.
    std::vector<InstanceId> gone;
    /// Those of `gone` whose process is there and sends no heartbeats.
    std::vector<InstanceId> silent;
    /// Instances that fell silent before, and whose process has left.
    std::vector<InstanceId> left;
  };

  /// Far more endpoints of a kind than a fabric has, since a stranger can announce any number. A
  /// further one displaces one of the participant with the most, which is ignored until it
  /// announces itself again.
  static constexpr std::size_t most_endpoints = 16'384;

  enum class Seen : std::uint8_t {
    taken,
    /// Another process has proved this instance, and still runs: ids are random, so this one is
    /// mistaken or lies. It counts once the other one is gone.
    second,
    /// There are too many, and no participant has more of them than this one.
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
  /// For tools, which send no requests: each request reader counts as matched.
  void match_readers() { readers_match_ = true; }
  /// The same for reply writers, without trust: nothing proves an instance then.
  void match_all() { readers_match_ = writers_match_ = true; }

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
  /// process that has proved it, if one has. It may have left since; its earlier samples may still
  /// be untaken.
  [[nodiscard]] bool speaks_for(EndpointHandle writer, const InstanceId& instance) const;
  /// The same for a writer of heartbeats.
  [[nodiscard]] bool heartbeats_for(EndpointHandle writer, const InstanceId& instance) const;
  /// This participant is the instance's process.
  [[nodiscard]] bool is_home(EndpointHandle participant, const InstanceId& instance) const {
    const Reader* const home = home_of(instance);
    return home != nullptr && home->participant == participant;
  }
  /// A present participant has proved the instance.
  [[nodiscard]] bool has_home(const InstanceId& instance) const {
    return home_of(instance) != nullptr;
  }

  /// How often a call of the instance may run, as its home announces; of an instance without a home
  /// at least once.
  [[nodiscard]] Delivery delivery_of(const InstanceId& instance) const {
    const Reader* const home = home_of(instance);
    return home != nullptr ? home->identity.delivery : Delivery::at_least_once;
  }

  /// The instances that may have changed since the last call of changes(), with the UUID that their
  /// home has proved; nullopt: they have no home.
  [[nodiscard]] std::vector<std::pair<InstanceId, std::optional<std::string>>> touched_homes()
      const;

  /// The changes since the last call. An instance is ready when its home's request reader and reply
  /// writer are matched, and its home is not silent. Its home is an authenticated participant with
  /// a reply writer that DDS has matched, so that it may answer for the UUID: an announcement alone
  /// proves nothing. Of several the one that made the id, otherwise the first.
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
    /// Its request readers, its reply writers, and its writers of heartbeats.
    std::set<EndpointHandle> readers;
    std::set<EndpointHandle> writers;
    std::set<EndpointHandle> heartbeat_writers;
    /// When the missing identity is reported; nullopt: it has one, or it was reported.
    std::optional<SteadyTime> reported_at{};
  };

  /// Far more writers than leave before their last samples are taken.
  static constexpr std::size_t most_departed = 256;

  struct SeenReader : Reader {
    /// Its participant had a matched reply writer of this instance and UUID.
    bool proved = false;
  };

  [[nodiscard]] bool is_authenticated(EndpointHandle participant) const {
    return !authentication_required_ || names_.contains(participant);
  }
  [[nodiscard]] bool was_authenticated(EndpointHandle participant) const {
    return is_authenticated(participant) || gone_names_.contains(participant);
  }
  void report_unauthenticated(Process& process, SteadyTime now);
  [[nodiscard]] const InstanceIdentity* ready_now(const InstanceId& id) const;
  /// Its process is there and sends no heartbeats.
  [[nodiscard]] bool is_silent(const InstanceId& id) const;
  [[nodiscard]] bool can_answer(const Reader& reader) const;
  /// Evaluates which participants have proved the instance.
  void prove(const InstanceId& id);
  /// Whether there is room for one more endpoint of this participant; `of` is its kind.
  bool make_room(std::set<EndpointHandle> Process::*of, EndpointHandle participant);
  [[nodiscard]] const Writer* writer_of(EndpointHandle handle) const;
  /// The request reader of the instance's process; null if none has proved it.
  [[nodiscard]] const SeenReader* home_of(const InstanceId& id) const;
  [[nodiscard]] static SteadyTime silent_at(const Process& process);
  /// on_time must be called at `time`, if not before.
  void check_at(SteadyTime time) {
    check_at_ = std::min(check_at_.value_or(SteadyTime::max()), time);
  }
  void forget_reader(EndpointHandle handle);
  void forget_writer(EndpointHandle handle);
  void forget_heartbeat_writer(EndpointHandle handle);
  void forget_process(EndpointHandle participant);
  void touch(EndpointHandle handle);
  void touch_all_of(const Process& process);

  std::unordered_map<EndpointHandle, SeenReader> readers_;
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
  bool readers_match_ = false;
  bool writers_match_ = false;
  bool authentication_required_ = false;
  /// The proved name, by participant.
  std::map<EndpointHandle, std::string> names_;
  base::Recent<EndpointHandle> gone_names_{most_departed};
  std::vector<std::pair<InstanceId, std::string>> unauthenticated_;
  std::map<InstanceId, InstanceIdentity> announced_;
  std::set<InstanceId> silent_;
  /// Instances that may have changed since the last call of changes().
  std::set<InstanceId> touched_;
  std::optional<SteadyTime> check_at_;
};

}  // namespace millrace::fabric::registry
