#include "fabric/observer/observer.hpp"

#include <optional>

#include <boost/asio/steady_timer.hpp>

#include "fabric/dds/post_once.hpp"
#include "fabric/ends/discovery.hpp"
#include "fabric/observer/context.hpp"
#include "fabric/observer/loads.hpp"
#include "fabric/wire/command_codec.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::fabric::observer {

namespace {

using wire::Presence;

/// Batches of 64 samples that are taken from one reader before the next one has its turn.
constexpr int batches_per_turn = 16;

/// A sample as an entry; nothing if it only tells of a presence nobody asks for.
template <typename Value>
std::optional<Sample> sample_of(wire::Taken<Value>&& taken) {
  if (!taken.valid) {
    return std::nullopt;
  }
  return std::move(taken.value);
}

std::optional<Sample> sample_of(wire::Taken<Request>&& taken) {
  if (taken.valid) {
    return std::move(taken.value);
  }
  if (taken.presence == Presence::withdrawn) {
    // The context knows the number.
    return Withdrawal{.key = std::move(taken.value.key),
                      .call = {.epoch = taken.value.call.epoch},
                      .instance = taken.value.assigned};
  }
  return std::nullopt;
}

/// A channel or machine whose gateway left would look alive for ever.
constexpr const char* gateway_gone = "its gateway is gone";

std::optional<Sample> sample_of(wire::Taken<ChannelStatus>&& taken) {
  if (taken.presence != Presence::alive) {
    return ChannelStatus{.key = std::move(taken.value.key),
                         .since = std::chrono::system_clock::now(),
                         .reason = gateway_gone};
  }
  return std::move(taken.value);
}

std::optional<Sample> sample_of(wire::Taken<MachineStatus>&& taken) {
  if (taken.presence != Presence::alive) {
    return MachineStatus{.machine = std::move(taken.value.machine),
                         .gateway = taken.value.gateway,
                         .since = std::chrono::system_clock::now(),
                         .reason = gateway_gone};
  }
  return std::move(taken.value);
}

}  // namespace

struct Observer::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, const boost::asio::any_io_executor& executor,
       ObserverListener& own_listener)
      : participant(own_participant), listener(&own_listener), silence(executor) {
    registry.match_all();
  }

  void open(const boost::asio::any_io_executor& executor, Interest interest);
  void close();
  bool drain();
  void drain_discovery();
  bool drain_beats();
  void await_silence();
  void tell_changes();
  void hand_out(Sample sample);

  template <typename Value>
  void open(std::optional<wire::Reader<Value>>& reader, const std::string& partition) {
    const dds::Listener on_data(dds_create_listener(nullptr));
    post->listen_for_data(on_data.get());
    reader.emplace(participant, partition, wire::Keep::all,
                   wire::EndpointOptions{.listener = on_data.get()});
  }

  template <typename Use>
  void for_each_reader(Use use) {
    use(machines);
    use(channels);
    use(requests);
    use(replies);
    use(events);
    use(commands);
    use(outcomes);
  }

  /// One turn of a reader; true if there may be more.
  template <typename Value>
  bool drain(std::optional<wire::Reader<Value>>& reader) {
    for (int i = 0; i < batches_per_turn && listener != nullptr && reader; ++i) {
      auto batch = reader->take();
      if (batch.empty()) {
        return false;
      }
      for (wire::Taken<Value>& taken : batch) {
        if (auto sample = sample_of(std::move(taken))) {
          hand_out(std::move(*sample));
        }
      }
    }
    return listener != nullptr && reader;
  }

  dds::Participant& participant;
  /// Null once the observer is closed.
  ObserverListener* listener;
  registry::Registry registry;
  Context context;
  std::uint64_t delivered = 0;
  // Before the entities that wake it.
  std::optional<dds::PostOnce> post;
  std::optional<ends::Discovery> discovery;
  std::optional<wire::Reader<MachineStatus>> machines;
  std::optional<wire::Reader<ChannelStatus>> channels;
  std::optional<wire::Reader<Beat>> beats;
  Loads loads;
  /// Rings when somebody has been silent for too long.
  boost::asio::steady_timer silence;
  std::optional<SteadyTime> silence_at;
  std::optional<wire::Reader<Request>> requests;
  std::optional<wire::Reader<Reply>> replies;
  std::optional<wire::Reader<Event>> events;
  std::optional<wire::Reader<Command>> commands;
  std::optional<wire::Reader<Outcome>> outcomes;
};

void Observer::Impl::open(const boost::asio::any_io_executor& executor, Interest interest) {
  post.emplace(executor, weak_from_this(), [this] { drain(); });
  const std::string& fabric = participant.options().fabric;
  const std::string services = wire::all_services(fabric);
  open(channels, fabric);
  if (interest != Interest::calls) {
    const dds::Listener on_endpoint(dds_create_listener(nullptr));
    post->listen_for_data(on_endpoint.get());
    discovery.emplace(participant, on_endpoint.get());
    open(machines, fabric);
    open(beats, fabric);
  }
  if (interest != Interest::states) {
    open(events, fabric);
  }
  if (interest == Interest::everything) {
    open(requests, services);
    open(replies, services);
    open(commands, fabric);
    open(outcomes, fabric);
  }
}

void Observer::Impl::close() {
  listener = nullptr;
  silence.cancel();
  for_each_reader([](auto& reader) { reader.reset(); });
  beats.reset();
  discovery.reset();
}

bool Observer::Impl::drain() {
  drain_discovery();
  bool more = drain_beats();
  for_each_reader([&](auto& reader) { more = drain(reader) || more; });
  if (more) {
    // Others on the executor have their turn in between.
    post->post();
  }
  return more;
}

void Observer::Impl::drain_discovery() {
  if (listener == nullptr || !discovery) {
    return;
  }
  discovery->drain(registry, std::chrono::steady_clock::now());
  tell_changes();
}

/// Of beats nobody wants to know each.
bool Observer::Impl::drain_beats() {
  bool more = false;
  for (int i = 0; i < batches_per_turn && listener != nullptr && beats; ++i) {
    const auto batch = beats->take();
    more = !batch.empty();
    if (!more) {
      break;
    }
    const SteadyTime at = std::chrono::steady_clock::now();
    for (const wire::Taken<Beat>& taken : batch) {
      if (!taken.valid || !registry.beat(taken.writer, at)) {
        continue;
      }
      for (const InstanceLoad& load : taken.value.loads) {
        if (registry.beats_for(taken.writer, load.status.instance) &&
            loads.is_news(load.status, at)) {
          hand_out(load.status);
        }
      }
    }
  }
  tell_changes();
  return more;
}

void Observer::Impl::await_silence() {
  const auto next = registry.next_time();
  if (next == silence_at) {
    return;
  }
  silence_at = next;
  silence.cancel();
  if (!next) {
    return;
  }
  silence.expires_at(*next);
  silence.async_wait([self = weak_from_this(), due = *next](boost::system::error_code error) {
    const auto alive = self.lock();
    if (error || !alive || alive->listener == nullptr) {
      return;
    }
    alive->silence_at.reset();
    // While this process stood still it heard nobody; what has come since is not silence.
    alive->registry.stood_still(std::chrono::steady_clock::now() - due);
    alive->drain_beats();
    alive->registry.on_time(std::chrono::steady_clock::now());
    alive->tell_changes();
  });
}

void Observer::Impl::tell_changes() {
  if (listener == nullptr) {
    return;
  }
  const registry::Registry::Changes changes = registry.changes();
  await_silence();
  static_cast<void>(registry.take_vanished());
  for (const InstanceId& instance : changes.gone) {
    loads.forget(instance);
    hand_out(InstanceNews{Change::gone, {.id = instance}});
  }
  for (const InstanceIdentity& identity : changes.ready) {
    hand_out(InstanceNews{Change::ready, identity});
  }
  for (const InstanceIdentity& identity : changes.changed) {
    hand_out(InstanceNews{Change::changed, identity});
  }
}

void Observer::Impl::hand_out(Sample sample) {
  if (listener == nullptr) {
    return;
  }
  ++delivered;
  Entry entry{.at = std::chrono::system_clock::now(), .sample = std::move(sample)};
  context.complete(entry);
  listener->on_entry(std::move(entry));
}

Observer::Observer(dds::Participant& participant, boost::asio::any_io_executor executor,
                   ObserverListener& listener, Interest interest)
    : impl_(std::make_shared<Impl>(participant, executor, listener)) {
  impl_->open(executor, interest);
}

Observer::~Observer() {
  impl_->close();
}

bool Observer::drain() {
  return impl_->drain();
}

Counts Observer::counts() const {
  Counts counts{.delivered = impl_->delivered};
  impl_->for_each_reader([&](const auto& reader) {
    if (reader) {
      counts.lost += reader->lost();
    }
  });
  return counts;
}

}  // namespace millrace::fabric::observer
