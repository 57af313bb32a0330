#include "fabric/ends/gateway_watch.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "base/program/barrier.hpp"
#include "fabric/dds/badges.hpp"
#include "fabric/dds/post_once.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::fabric::ends {

namespace {

/// What gateways claim, as the writer says that claimed it first.
struct MachineClaim {
  dds_instance_handle_t writer = 0;
  MachineStatus status;
  /// Its writer is taken for gone.
  bool lost = false;
};

}  // namespace

struct GatewayWatch::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, boost::asio::any_io_executor own_executor,
       GatewayWatchListener& own_listener)
      : participant(own_participant), executor(std::move(own_executor)), listener(&own_listener) {}

  void open();
  void watch_channels();
  void close();
  void drain_machines();
  void drain_channels();
  void listen_for_losses(dds_listener_t* on_machine);
  void take_machine(const wire::Taken<MachineStatus>& taken);
  void take_lost_writers();
  void lose(MachineClaim& claim);
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
  std::map<std::pair<std::string, InstanceId>, MachineClaim> claims;
  std::mutex lock;
  /// Writers that are gone or taken for gone; with the lock, since Cyclone's threads add to it. DDS
  /// says that of each writer, while the state of an instance is one for all who write its key.
  std::vector<dds_instance_handle_t> lost_writers;
  std::optional<wire::Reader<MachineStatus>> machines;
  std::optional<wire::Reader<ChannelStatus>> channels;
};

void GatewayWatch::Impl::open() {
  machine_post.emplace(executor, weak_from_this(), [this] { drain_machines(); });
  const dds::Listener on_machine(dds_create_listener(nullptr));
  machine_post->listen_for_data(on_machine.get());
  listen_for_losses(on_machine.get());
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
      take_lost_writers();
      drop_revoked();
      return;
    }
    for (const wire::Taken<MachineStatus>& taken : batch) {
      take_machine(taken);
    }
  }
}

/// That a gateway is gone is not for another one to say. None ever disposes its key, so an instance
/// that is disposed says nothing, also one that a sample of its gateway shows.
void GatewayWatch::Impl::take_machine(const wire::Taken<MachineStatus>& taken) {
  // Far more than there are; of others it is not noticed who has said it.
  constexpr std::size_t most = 65'536;
  const std::pair key(taken.value.machine, taken.value.gateway);
  const auto known = claims.find(key);
  if (taken.presence == wire::Presence::orphaned) {
    if (known != claims.end()) {
      lose(known->second);
    } else if (listener != nullptr) {
      listener->on_machine_gone(key.first, key.second);
    }
    return;
  }
  if (!taken.valid) {
    return;
  }
  if (known != claims.end() && known->second.writer == taken.writer &&
      taken.value.claimed == Time{}) {
    lose(known->second);
    claims.erase(known);
    return;
  }
  if (known != claims.end() && (known->second.writer == taken.writer || known->second.lost)) {
    known->second = {taken.writer, taken.value};
  } else if (known == claims.end() && claims.size() < most) {
    // The first one, so that nobody makes a gateway's claim its own.
    claims.emplace(key, MachineClaim{taken.writer, taken.value});
  }
  if (listener != nullptr) {
    listener->on_machine(taken.value);
  }
}

void GatewayWatch::Impl::lose(MachineClaim& claim) {
  if (!std::exchange(claim.lost, true) && listener != nullptr) {
    listener->on_machine_gone(claim.status.machine, claim.status.gateway);
  }
}

void GatewayWatch::Impl::listen_for_losses(dds_listener_t* on_machine) {
  const auto add = [](dds_entity_t, const dds_liveliness_changed_status_t status,
                      void* self) noexcept {
    auto& impl = *static_cast<Impl*>(self);
    if (status.alive_count_change < 0) {
      base::program::contain("noting that a gateway is gone", [&] {
        const std::lock_guard guard(impl.lock);
        impl.lost_writers.push_back(status.last_publication_handle);
      });
      impl.machine_post->post();
    }
  };
  dds_lset_liveliness_changed_arg(on_machine, add, this, true);
}

void GatewayWatch::Impl::take_lost_writers() {
  std::vector<dds_instance_handle_t> lost;
  {
    const std::lock_guard guard(lock);
    lost.swap(lost_writers);
  }
  if (lost.empty()) {
    return;
  }
  for (auto& [key, claim] : claims) {
    if (std::ranges::count(lost, claim.writer) > 0) {
      lose(claim);
    }
  }
  const std::vector<dds_instance_handle_t> there = machines->matched();
  std::erase_if(claims, [&](const auto& one) {
    return one.second.lost && std::ranges::count(there, one.second.writer) == 0;
  });
}

void GatewayWatch::Impl::drop_revoked() {
  if (!badges || badges->take().empty()) {
    return;
  }
  std::vector<std::pair<std::string, InstanceId>> gone;
  std::erase_if(claims, [&](const auto& one) {
    const bool revoked = participant.badges()->of_writer(one.second.writer).revoked;
    if (revoked && !one.second.lost) {
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
