// What a page gets about the plant: a snapshot, then changes. Pure.
//
//   plant.add(entry, now);                              // each entry of an observer, as it comes
//   plant.greeting(now)                                 // for a new page
//   if (auto changes = plant.changes(now)) …            // several times a second, for all pages
//
// The objects have the fields of the commands' --json, and more (docs/how-to/monitor.md).
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

#include "fabric/moment.hpp"
#include "fabric/observer/observer.hpp"
#include "fabric/plant/assess.hpp"
#include "fabric/plant/plant.hpp"
#include "tools/web/plant/call_store.hpp"
#include "tools/web/plant/data_store.hpp"
#include "tools/web/plant/event_book.hpp"
#include "tools/web/plant/history.hpp"
#include "tools/web/plant/program_store.hpp"
#include "tools/web/plant/throughput.hpp"

namespace millrace::tools::web::plant {

struct About {
  std::string version{};
  std::string host{};
  std::string fabric{};
  std::uint32_t domain = 0;
  /// For suggested commands (fabric::profile::given_flags).
  std::string flags{};
  fabric::Time started{};
  bool recordings = false;
  bool actions = false;
};

/// A user has acknowledged a cause that the page shows.
struct Acknowledgement {
  /// Concern::cause, and what it is about.
  std::string cause{};
  fabric::Message name{};
  /// When the cause began, as the page has it.
  std::string since{};
  std::string by{};
  std::string note{};
};

class PlantModel {
 public:
  /// Limits for the calls in a snapshot and in a change.
  static constexpr std::size_t calls_in_snapshot = 200;
  static constexpr std::size_t calls_in_change = 50;
  static constexpr std::size_t events_in_snapshot = 100;
  static constexpr std::size_t most_acknowledged = 100;
  /// Longest time between two changes; they are the heartbeat for pages.
  static constexpr std::chrono::seconds heartbeat{2};
  /// An instance that is gone is shown this long, also on pages that are opened later.
  static constexpr std::chrono::minutes kept_gone{15};
  /// Pause between updates of a busy channel; a channel that needs attention is sent at once.
  static constexpr std::chrono::milliseconds pause_of_a_busy_channel{500};

  explicit PlantModel(About about, NormalStates normal = {})
      : about_(std::move(about)), calls_({}, std::move(normal)) {}

  /// The call that ends with this entry; valid until the next one.
  const EndedCall* add(const recording::Entry& entry, const fabric::Moment& now);
  /// Replaces an earlier one of the same cause.
  void acknowledge(Acknowledgement acknowledgement, fabric::Time at);
  /// As Plant::set_other_fabrics().
  void set_other_fabrics(std::set<std::string> names) { live_.set_other_fabrics(std::move(names)); }
  /// What the present concern with this cause is about; empty if there is none.
  [[nodiscard]] fabric::Message subject_of(const std::string& cause,
                                           const fabric::Moment& now) const;
  /// Removes machines without a gateway, until one reports them again; nothing is removed, and the
  /// result is false, if one of them has a gateway or is unknown.
  bool forget(const std::vector<std::string>& machines, const std::string& by, fabric::Time at);
  /// Counters of the observer.
  void set_counts(const fabric::observer::Counts& counts) { counts_ = counts; }

  [[nodiscard]] boost::json::object snapshot(const fabric::Moment& now) const;
  /// The snapshot for a page that gets the changes from now on.
  [[nodiscard]] boost::json::object greeting(const fabric::Moment& now);
  /// Changes since the last call; nothing if there are none and no heartbeat is due.
  std::optional<boost::json::object> changes(const fabric::Moment& now);

  [[nodiscard]] boost::json::object about(const fabric::Moment& now) const;
  [[nodiscard]] boost::json::array machines() const;
  [[nodiscard]] boost::json::array channels(const fabric::Moment& now) const;
  [[nodiscard]] boost::json::array services(const fabric::Moment& now) const;
  /// Of all processes, also those that report that they run well.
  [[nodiscard]] boost::json::array alarms() const;
  /// What needs attention, the worst first.
  [[nodiscard]] std::vector<fabric::plant::Concern> concerns(const fabric::Moment& now) const;
  /// The oldest first.
  [[nodiscard]] const boost::json::array& acknowledged() const { return acknowledged_; }
  /// The newest first.
  [[nodiscard]] boost::json::array events() const { return events_.list(EventBook::most_events); }
  /// {calls, kept, oldest}.
  [[nodiscard]] boost::json::object calls(const CallFilter& filter, std::size_t most) const;
  [[nodiscard]] boost::json::object history() const { return history_.json(); }
  [[nodiscard]] const fabric::plant::Plant& live() const { return live_; }
  [[nodiscard]] const CallStore& call_store() const { return calls_; }
  /// Pages request data themselves: snapshots and changes have only the numbers of groups.
  [[nodiscard]] const DataStore& data() const { return data_; }
  [[nodiscard]] const ProgramStore& programs() const { return programs_; }

  /// The same object for all lists of calls.
  [[nodiscard]] boost::json::object json_of(const EndedCall& call) const;

 private:
  using MachineKey = fabric::plant::Plant::Machines::key_type;

  void add_news(const recording::InstanceNews& news);
  void add_link(const fabric::MachineStatus& status, bool begins_again, fabric::Time received);
  void add_ended(const EndedCall& ended, const fabric::Moment& now);
  /// The machine had another gateway before this first sample.
  [[nodiscard]] bool has_another_gateway(const fabric::MachineStatus& status) const;
  void mark_all_of_gateway(const fabric::InstanceId& gateway);
  void mark_callers_of(const recording::InstanceNews& news);
  void mark_all_of(const std::string& machine);
  void mark_what_moves(const fabric::Moment& now);
  /// Marks the channels that are shown in another way by now. Returns those that are there no
  /// longer.
  boost::json::array mark_views(const fabric::Moment& now);
  void end_steps(const fabric::Moment& now);
  [[nodiscard]] bool may_wait(const fabric::ChannelKey& key, const fabric::Moment& now) const;
  /// The gateway is gone, and the machine has another one.
  [[nodiscard]] bool is_former(const fabric::MachineStatus& status) const;
  [[nodiscard]] boost::json::object machine_json(const fabric::MachineStatus& status) const;
  /// The common name of all its instances; nothing where their names differ.
  [[nodiscard]] std::string name_of_service(const std::string& uuid) const;
  [[nodiscard]] boost::json::object channel_json(const fabric::ChannelStatus& status,
                                                 const fabric::Moment& now) const;
  [[nodiscard]] boost::json::object service_json(const fabric::plant::KnownInstance& instance,
                                                 const fabric::Moment& now) const;
  [[nodiscard]] boost::json::object totals(const fabric::Moment& now) const;
  boost::json::array take_calls(std::uint64_t& skipped);

  About about_;
  fabric::plant::Plant live_;
  CallStore calls_;
  DataStore data_;
  ProgramStore programs_;
  EventBook events_;
  boost::json::array acknowledged_;
  History history_;
  /// By UUID: the name of the last instance, for services without instances.
  std::map<std::string, std::string> service_names_;
  std::map<fabric::ChannelKey, Throughput> channel_pace_;
  std::map<fabric::InstanceId, Throughput> instance_pace_;
  /// The last request on a channel that did not become a call. Its text is not published again.
  std::map<fabric::ChannelKey, fabric::Event> left_;
  /// Channels whose figures change without a new sample.
  std::set<fabric::ChannelKey> moving_channels_;
  std::set<fabric::InstanceId> moving_instances_;
  Throughput throughput_;
  /// When the first call ended.
  fabric::SteadyTime counting_since_{};
  std::uint64_t ended_ = 0;
  std::uint64_t failed_ = 0;
  std::uint64_t other_states_ = 0;
  /// By instance, since the start of this server.
  std::map<fabric::InstanceId, std::uint64_t> other_states_of_;
  fabric::observer::Counts counts_;

  // Not sent to pages yet.
  std::set<MachineKey> machines_changed_;
  std::set<fabric::ChannelKey> channels_changed_;
  std::set<fabric::InstanceId> services_changed_;
  std::set<fabric::InstanceId> services_gone_;
  std::vector<fabric::CallId> calls_ended_;
  bool acknowledged_changed_ = false;

  /// How and when each channel was last sent.
  struct SentChannel {
    fabric::SteadyTime at{};
    fabric::plant::ChannelView view{};
  };
  std::map<fabric::ChannelKey, SentChannel> channels_sent_;
  std::vector<fabric::plant::Concern> concerns_sent_;
  /// A page has joined since. Its snapshot may have concerns that began later and are over by now.
  bool greeted_ = false;
  std::optional<fabric::SteadyTime> published_at_;
  std::optional<fabric::SteadyTime> moved_;
  std::optional<fabric::SteadyTime> stepped_;
};

}  // namespace millrace::tools::web::plant
