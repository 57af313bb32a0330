#include "tools/bus/observer.hpp"

#include <optional>

#include "fabric/dds/post_once.hpp"
#include "fabric/ends/discovery.hpp"
#include "fabric/wire/command_codec.hpp"
#include "fabric/wire/reader.hpp"
#include "tools/bus/context.hpp"

namespace millrace::tools::bus {

namespace {

using fabric::wire::Presence;
using recording::Entry;

/// Batches of 64 samples that are taken from one reader before the next one has its turn.
constexpr int batches_per_turn = 16;

fabric::Time now() {
  return std::chrono::time_point_cast<fabric::Time::duration>(std::chrono::system_clock::now());
}

/// A sample as an entry; nothing if it only tells of a presence nobody asks for.
template <typename Value>
std::optional<recording::Sample> sample_of(fabric::wire::Taken<Value>&& taken) {
  if (!taken.valid) {
    return std::nullopt;
  }
  return std::move(taken.value);
}

std::optional<recording::Sample> sample_of(fabric::wire::Taken<fabric::Request>&& taken) {
  if (taken.valid) {
    return std::move(taken.value);
  }
  if (taken.presence == Presence::withdrawn) {
    // The context knows the number.
    return recording::Withdrawal{.key = std::move(taken.value.key),
                                 .call = {.epoch = taken.value.call.epoch}};
  }
  return std::nullopt;
}

/// A channel or machine whose gateway left would look alive for ever.
constexpr const char* gateway_gone = "its gateway is gone";

std::optional<recording::Sample> sample_of(fabric::wire::Taken<fabric::ChannelStatus>&& taken) {
  if (taken.presence != Presence::alive) {
    return fabric::ChannelStatus{
        .key = std::move(taken.value.key), .since = now(), .reason = gateway_gone};
  }
  return std::move(taken.value);
}

std::optional<recording::Sample> sample_of(fabric::wire::Taken<fabric::MachineStatus>&& taken) {
  if (taken.presence != Presence::alive) {
    return fabric::MachineStatus{.machine = std::move(taken.value.machine),
                                 .gateway = taken.value.gateway,
                                 .since = now(),
                                 .reason = gateway_gone};
  }
  return std::move(taken.value);
}

}  // namespace

struct Observer::Impl : std::enable_shared_from_this<Impl> {
  Impl(fabric::dds::Participant& own_participant, ObserverListener& own_listener)
      : participant(own_participant), listener(&own_listener) {
    registry.match_all();
  }

  void open(const boost::asio::any_io_executor& executor, Interest interest);
  void close();
  bool drain();
  void drain_discovery();
  void hand_out(recording::Sample sample);

  template <typename Value>
  void open(std::optional<fabric::wire::Reader<Value>>& reader, const std::string& partition) {
    const fabric::dds::Listener on_data(dds_create_listener(nullptr));
    post->listen_for_data(on_data.get());
    reader.emplace(participant, partition, fabric::wire::Keep::all,
                   fabric::wire::EndpointOptions{.listener = on_data.get()});
  }

  template <typename Use>
  void for_each_reader(Use use) {
    use(machines);
    use(channels);
    use(instances);
    use(requests);
    use(replies);
    use(events);
    use(commands);
    use(outcomes);
  }

  /// One turn of a reader; true if there may be more.
  template <typename Value>
  bool drain(std::optional<fabric::wire::Reader<Value>>& reader) {
    for (int i = 0; i < batches_per_turn && listener != nullptr && reader; ++i) {
      auto batch = reader->take();
      if (batch.empty()) {
        return false;
      }
      for (fabric::wire::Taken<Value>& taken : batch) {
        if (auto sample = sample_of(std::move(taken))) {
          hand_out(std::move(*sample));
        }
      }
    }
    return listener != nullptr && reader;
  }

  fabric::dds::Participant& participant;
  /// Null once the observer is closed.
  ObserverListener* listener;
  fabric::registry::Registry registry;
  Context context;
  std::uint64_t delivered = 0;
  // Before the entities that wake it.
  std::optional<fabric::dds::PostOnce> post;
  std::optional<fabric::ends::Discovery> discovery;
  std::optional<fabric::wire::Reader<fabric::MachineStatus>> machines;
  std::optional<fabric::wire::Reader<fabric::ChannelStatus>> channels;
  std::optional<fabric::wire::Reader<fabric::InstanceStatus>> instances;
  std::optional<fabric::wire::Reader<fabric::Request>> requests;
  std::optional<fabric::wire::Reader<fabric::Reply>> replies;
  std::optional<fabric::wire::Reader<fabric::Event>> events;
  std::optional<fabric::wire::Reader<fabric::Command>> commands;
  std::optional<fabric::wire::Reader<fabric::Outcome>> outcomes;
};

void Observer::Impl::open(const boost::asio::any_io_executor& executor, Interest interest) {
  post.emplace(executor, weak_from_this(), [this] { drain(); });
  const fabric::dds::Listener on_endpoint(dds_create_listener(nullptr));
  post->listen_for_data(on_endpoint.get());
  discovery.emplace(participant, on_endpoint.get());

  const std::string& fabric = participant.options().fabric;
  const std::string services = fabric::wire::all_services(fabric);
  open(machines, fabric);
  open(channels, fabric);
  open(instances, services);
  if (interest == Interest::everything) {
    open(requests, services);
    open(replies, services);
    open(events, fabric);
    open(commands, fabric);
    open(outcomes, fabric);
  }
}

void Observer::Impl::close() {
  listener = nullptr;
  for_each_reader([](auto& reader) { reader.reset(); });
  discovery.reset();
}

bool Observer::Impl::drain() {
  drain_discovery();
  bool more = false;
  for_each_reader([&](auto& reader) { more = drain(reader) || more; });
  if (more) {
    // Others on the executor have their turn in between.
    post->post();
  }
  return more;
}

void Observer::Impl::drain_discovery() {
  if (listener == nullptr) {
    return;
  }
  discovery->drain(registry);
  const fabric::registry::Registry::Changes changes = registry.changes();
  for (const fabric::InstanceId& instance : changes.gone) {
    hand_out(recording::InstanceNews{recording::Change::gone, {.id = instance}});
  }
  for (const fabric::InstanceIdentity& identity : changes.ready) {
    hand_out(recording::InstanceNews{recording::Change::ready, identity});
  }
  for (const fabric::InstanceIdentity& identity : changes.changed) {
    hand_out(recording::InstanceNews{recording::Change::changed, identity});
  }
}

void Observer::Impl::hand_out(recording::Sample sample) {
  if (listener == nullptr) {
    return;
  }
  ++delivered;
  Entry entry{.at = now(), .sample = std::move(sample)};
  context.complete(entry);
  listener->on_entry(std::move(entry));
}

Observer::Observer(fabric::dds::Participant& participant, boost::asio::any_io_executor executor,
                   ObserverListener& listener, Interest interest)
    : impl_(std::make_shared<Impl>(participant, listener)) {
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

}  // namespace millrace::tools::bus
