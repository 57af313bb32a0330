#include "tools/bus/snapshot.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include <boost/asio/io_context.hpp>

#include "fabric/dds/entity.hpp"
#include "fabric/observer/observer.hpp"
#include "fabric/wire/reader.hpp"
#include "tools/bus/alarm_reader.hpp"

namespace millrace::tools::bus {

namespace {

using Clock = ListeningTime::Clock;

struct Listener : fabric::observer::ObserverListener, AlarmListener {
  explicit Listener(Patience patience) : time(patience, Clock::now()) {}

  void on_entry(fabric::observer::Entry entry) override {
    // Load and calls change all the time and show nothing about missing processes.
    if (live.add(entry)) {
      time.on_news(Clock::now());
    }
  }
  void on_alarm(const fabric::Alarm& alarm) override {
    if (live.add(alarm)) {
      time.on_news(Clock::now());
    }
  }
  void on_alarm_gone(const fabric::AlarmKey& key) override { live.take_back(key); }

  fabric::plant::Plant live;
  ListeningTime time;
};

/// Participants that are announced and not authenticated yet. DDS Security lets a participant show
/// its endpoints only after the proof, which takes a tenth of a second and, on a busy host, more.
class Unauthenticated {
 public:
  explicit Unauthenticated(const fabric::dds::Participant& participant)
      : participants_(reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT)),
        writers_(reader(participant, DDS_BUILTIN_TOPIC_DCPSPUBLICATION)) {}

  /// Reads discovery; true if a participant was authenticated since the last call.
  bool drain() {
    const auto announced = [&](const dds_builtintopic_participant_t& /*sample*/,
                               const dds_sample_info_t& info) {
      if (info.valid_data &&
          fabric::wire::instance_state_of(info) == fabric::wire::InstanceState::alive) {
        waiting_.insert(info.instance_handle);
      } else {
        waiting_.erase(info.instance_handle);
      }
    };
    bool changed = false;
    const auto showed = [&](const dds_builtintopic_endpoint_t& sample,
                            const dds_sample_info_t& info) {
      if (info.valid_data) {
        proved_.insert(sample.participant_instance_handle);
      }
    };
    while (fabric::wire::take_lent<dds_builtintopic_participant_t>(participants_.handle(),
                                                                   announced) > 0) {
    }
    while (fabric::wire::take_lent<dds_builtintopic_endpoint_t>(writers_.handle(), showed) > 0) {
    }
    for (const dds_instance_handle_t one : proved_) {
      changed = waiting_.erase(one) > 0 || changed;
    }
    return changed;
  }

  [[nodiscard]] bool any() const { return !waiting_.empty(); }

 private:
  static fabric::dds::Entity reader(const fabric::dds::Participant& participant,
                                    dds_entity_t topic) {
    return fabric::dds::Entity(
        fabric::dds::check(dds_create_reader(participant.handle(), topic, nullptr, nullptr),
                           "read the participants of DDS"));
  }

  fabric::dds::Entity participants_;
  fabric::dds::Entity writers_;
  std::set<dds_instance_handle_t> waiting_;
  std::set<dds_instance_handle_t> proved_;
};

}  // namespace

fabric::plant::Plant take_snapshot(const fabric::dds::ParticipantOptions& options, Patience patience,
                          const std::function<bool(const fabric::plant::Plant&)>& enough) {
  fabric::dds::Participant participant(options);
  boost::asio::io_context io;
  const auto work = boost::asio::make_work_guard(io);
  Listener listener(patience);
  fabric::observer::Observer observer(participant, io.get_executor(), listener,
                                      fabric::observer::Interest::states);
  const AlarmReader alarms(participant, io.get_executor(), listener);
  std::optional<Unauthenticated> unauthenticated;
  if (options.trust) {
    unauthenticated.emplace(participant);
  }
  for (;;) {
    if (unauthenticated && unauthenticated->drain()) {
      listener.time.on_news(Clock::now());
    }
    const auto end = listener.time.end(unauthenticated && unauthenticated->any());
    const auto begun = Clock::now();
    if (begun >= end || enough(listener.live)) {
      return std::move(listener.live);
    }
    const auto due = std::min(end, begun + ListeningTime::look_again);
    io.run_one_until(due);
    listener.time.on_timer(due, Clock::now());
  }
}

}  // namespace millrace::tools::bus
