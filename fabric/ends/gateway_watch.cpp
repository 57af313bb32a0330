#include "fabric/ends/gateway_watch.hpp"

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "fabric/dds/badges.hpp"
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
  void remember(const wire::Taken<MachineStatus>& taken);
  [[nodiscard]] bool is_own(const wire::Taken<MachineStatus>& taken) const;
  /// Whose certificates have been taken back since: what they have said holds no more.
  void drop_revoked();

  dds::Participant& participant;
  boost::asio::any_io_executor executor;
  /// Null once the watch is closed.
  GatewayWatchListener* listener;
  // Before the readers that wake them.
  std::optional<dds::PostOnce> machine_post;
  std::optional<dds::PostOnce> channel_post;
  std::optional<dds::Badges::Watcher> badges;
  /// Who has claimed which machine, by the writer.
  std::map<std::pair<std::string, InstanceId>, dds_instance_handle_t> claimed;
  std::optional<wire::Reader<MachineStatus>> machines;
  std::optional<wire::Reader<ChannelStatus>> channels;
};

void GatewayWatch::Impl::open() {
  machine_post.emplace(executor, weak_from_this(), [this] { drain_machines(); });
  const dds::Listener on_machine(dds_create_listener(nullptr));
  machine_post->listen_for_data(on_machine.get());
  machines.emplace(participant, participant.options().fabric, wire::Keep::last,
                   wire::EndpointOptions{.listener = on_machine.get(), .others_only = true});
  if (participant.badges() != nullptr) {
    badges.emplace(*participant.badges(), [this] { machine_post->post(); });
  }
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
  badges.reset();
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
      drop_revoked();
      return;
    }
    for (const wire::Taken<MachineStatus>& taken : batch) {
      if (!is_own(taken)) {
        continue;
      }
      remember(taken);
      if (listener != nullptr && taken.valid && taken.presence == wire::Presence::alive) {
        listener->on_machine(taken.value);
      } else if (listener != nullptr && taken.presence != wire::Presence::alive) {
        listener->on_machine_gone(taken.value.machine, taken.value.gateway);
      }
    }
  }
}

/// That a gateway is gone is not for another one to say.
bool GatewayWatch::Impl::is_own(const wire::Taken<MachineStatus>& taken) const {
  const auto known = claimed.find({taken.value.machine, taken.value.gateway});
  return taken.presence != wire::Presence::withdrawn || known == claimed.end() ||
         known->second == taken.writer;
}

void GatewayWatch::Impl::remember(const wire::Taken<MachineStatus>& taken) {
  // Far more than there are; of others it is not noticed who has said it.
  constexpr std::size_t most = 65'536;
  const std::pair key(taken.value.machine, taken.value.gateway);
  if (taken.presence != wire::Presence::alive) {
    claimed.erase(key);
  } else if (taken.valid && (claimed.size() < most || claimed.contains(key))) {
    // The first one, so that nobody makes a gateway's claim its own.
    claimed.try_emplace(key, taken.writer);
  }
}

void GatewayWatch::Impl::drop_revoked() {
  if (!badges || badges->take().empty()) {
    return;
  }
  std::vector<std::pair<std::string, InstanceId>> gone;
  std::erase_if(claimed, [&](const auto& one) {
    const bool revoked = participant.badges()->of_writer(one.second).revoked;
    if (revoked) {
      gone.push_back(one.first);
    }
    return revoked;
  });
  for (const auto& [machine, gateway] : gone) {
    if (listener != nullptr) {
      listener->on_machine_gone(machine, gateway);
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
