#include "fabric/ends/gateway_watch.hpp"

#include <optional>

#include "fabric/dds/post_once.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::fabric::ends {

struct GatewayWatch::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, boost::asio::any_io_executor own_executor,
       GatewayWatchListener& own_listener)
      : participant(own_participant), executor(std::move(own_executor)), listener(&own_listener) {}

  void open();
  void watch_channels();
  void close();
  void drain_machines();
  void drain_channels();

  dds::Participant& participant;
  boost::asio::any_io_executor executor;
  /// Null once the watch is closed.
  GatewayWatchListener* listener;
  // Before the readers that wake them.
  std::optional<dds::PostOnce> machine_post;
  std::optional<dds::PostOnce> channel_post;
  std::optional<wire::Reader<MachineStatus>> machines;
  std::optional<wire::Reader<ChannelStatus>> channels;
};

void GatewayWatch::Impl::open() {
  machine_post.emplace(executor, weak_from_this(), [this] { drain_machines(); });
  const dds::Listener on_machine(dds_create_listener(nullptr));
  machine_post->listen_for_data(on_machine.get());
  machines.emplace(participant, participant.options().fabric, wire::Keep::last,
                   wire::EndpointOptions{.listener = on_machine.get(), .others_only = true});
}

void GatewayWatch::Impl::watch_channels() {
  if (channels) {
    return;
  }
  channel_post.emplace(executor, weak_from_this(), [this] { drain_channels(); });
  const dds::Listener on_channel(dds_create_listener(nullptr));
  channel_post->listen_for_data(on_channel.get());
  // Several gateways may have spoken of one channel, and the newest word need not be the one that
  // counts.
  channels.emplace(participant, participant.options().fabric, wire::Keep::all,
                   wire::EndpointOptions{.listener = on_channel.get(), .others_only = true});
}

void GatewayWatch::Impl::close() {
  listener = nullptr;
  machines.reset();
  channels.reset();
}

void GatewayWatch::Impl::drain_machines() {
  // What they did last comes first: the end of a gateway is judged by it.
  drain_channels();
  // Each callback may close this watch.
  while (listener != nullptr && machines) {
    const auto batch = machines->take();
    if (batch.empty()) {
      return;
    }
    for (const wire::Taken<MachineStatus>& taken : batch) {
      if (listener != nullptr && taken.valid && taken.presence == wire::Presence::alive) {
        listener->on_machine(taken.value);
      } else if (listener != nullptr && taken.presence != wire::Presence::alive) {
        listener->on_machine_gone(taken.value.machine, taken.value.gateway);
      }
    }
  }
}

void GatewayWatch::Impl::drain_channels() {
  while (listener != nullptr && channels) {
    const auto batch = channels->take();
    if (batch.empty()) {
      return;
    }
    for (const wire::Taken<ChannelStatus>& taken : batch) {
      if (listener != nullptr && taken.valid) {
        listener->on_channel(taken.value);
      }
    }
  }
}

GatewayWatch::GatewayWatch(dds::Participant& participant, boost::asio::any_io_executor executor,
                           GatewayWatchListener& listener)
    : impl_(std::make_shared<Impl>(participant, std::move(executor), listener)) {
  impl_->open();
}

GatewayWatch::~GatewayWatch() {
  impl_->close();
}

void GatewayWatch::watch_channels() {
  impl_->watch_channels();
}

}  // namespace millrace::fabric::ends
