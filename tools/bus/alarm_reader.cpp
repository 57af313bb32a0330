#include "tools/bus/alarm_reader.hpp"

#include <optional>

#include "fabric/dds/listeners.hpp"
#include "fabric/observer/alarms.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::tools::bus {

namespace wire = fabric::wire;

struct AlarmReader::Impl : std::enable_shared_from_this<Impl> {
  explicit Impl(AlarmListener& own_listener) : listener(own_listener) {}

  void open(const fabric::dds::Participant& participant,
            const boost::asio::any_io_executor& executor) {
    post.emplace(executor, weak_from_this(), [this] { take(); });
    const fabric::dds::Listener on_data(dds_create_listener(nullptr));
    post->listen_for_data(on_data.get());
    reader.emplace(participant, participant.options().fabric, wire::Keep::all,
                   wire::EndpointOptions{.listener = on_data.get()});
  }

  void take() {
    while (reader) {
      auto batch = reader->take();
      if (batch.empty()) {
        return;
      }
      for (wire::Taken<fabric::Alarm>& taken : batch) {
        auto kept = owners.take(taken.value.key, taken.writer, taken.valid,
                                taken.instance_state == wire::InstanceState::alive);
        if (!kept) {
          continue;
        }
        taken.value.key = std::move(kept->key);
        kept->is_over ? listener.on_alarm_gone(taken.value.key) : listener.on_alarm(taken.value);
      }
      for (const fabric::AlarmKey& key : owners.gone(reader->matched())) {
        listener.on_alarm_gone(key);
      }
    }
  }

  AlarmListener& listener;
  fabric::observer::AlarmOwners owners;
  // Before the reader that wakes it.
  std::optional<fabric::dds::PostOnce> post;
  std::optional<wire::Reader<fabric::Alarm>> reader;
};

AlarmReader::AlarmReader(const fabric::dds::Participant& participant,
                         const boost::asio::any_io_executor& executor, AlarmListener& listener)
    : impl_(std::make_shared<Impl>(listener)) {
  impl_->open(participant, executor);
}

AlarmReader::~AlarmReader() {
  impl_->reader.reset();
}

}  // namespace millrace::tools::bus
