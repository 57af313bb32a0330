#include "tools/bus/alarm_reader.hpp"

#include <optional>

#include "fabric/observer/alarms.hpp"
#include "fabric/wire/subscription.hpp"

namespace millrace::tools::bus {

namespace wire = fabric::wire;

struct AlarmReader::Impl : std::enable_shared_from_this<Impl> {
  explicit Impl(AlarmListener& own_listener) : listener(own_listener) {}

  void open(const fabric::dds::Participant& participant,
            const boost::asio::any_io_executor& executor) {
    post.emplace(executor, weak_from_this(), [this] { drain(); });
    alarms = wire::Subscription<fabric::Alarm>(
        participant, *post, participant.options().fabric,
        [this](wire::Taken<fabric::Alarm>& taken) { take(taken); });
  }

  void drain() {
    alarms.drain();
    for (const fabric::AlarmKey& key : owners.gone(alarms->matched())) {
      listener.on_alarm_gone(key);
    }
  }

  void take(wire::Taken<fabric::Alarm>& taken) {
    auto kept = owners.take(taken.value.key, taken.writer, taken.valid,
                            taken.instance_state == wire::InstanceState::alive);
    if (!kept) {
      return;
    }
    taken.value.key = std::move(kept->key);
    kept->is_over ? listener.on_alarm_gone(taken.value.key) : listener.on_alarm(taken.value);
  }

  AlarmListener& listener;
  fabric::observer::AlarmOwners owners;
  // Before the subscription that wakes it.
  std::optional<fabric::dds::PostOnce> post;
  wire::Subscription<fabric::Alarm> alarms;
};

AlarmReader::AlarmReader(const fabric::dds::Participant& participant,
                         const boost::asio::any_io_executor& executor, AlarmListener& listener)
    : impl_(std::make_shared<Impl>(listener)) {
  impl_->open(participant, executor);
}

AlarmReader::~AlarmReader() {
  impl_->alarms.reset();
}

}  // namespace millrace::tools::bus
