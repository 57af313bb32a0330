#include "fabric/ends/gateway_watch.hpp"

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/program/barrier.hpp"
#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/complaints.hpp"
#include "fabric/dds/badges.hpp"
#include "fabric/dds/post_once.hpp"
#include "fabric/speakers.hpp"
#include "fabric/wire/reader.hpp"

namespace millrace::fabric::ends {

namespace {

using Handle = dds_instance_handle_t;
/// By machine and gateway.
using ClaimKey = std::pair<std::string, InstanceId>;

struct MachineClaim {
  Handle participant = DDS_HANDLE_NIL;
  MachineStatus status{};
  /// Its writer is taken for gone.
  bool lost = false;
};
struct ChannelWord {
  Handle participant = DDS_HANDLE_NIL;
  ChannelStatus status{};
};
using Claims = Speakers<ClaimKey, MachineClaim>;
using Channels = Speakers<ChannelKey, ChannelWord>;

bool covers(const MachineStatus& status, const ChannelKey& key) {
  const bool queue = machine_of(key.machine) != key.machine;
  return queue || status.claims.empty() || std::ranges::count(status.claims, key.channel) > 0;
}

/// Nobody speaks for a gateway but itself, also while it is taken for gone.
constexpr auto first_come = [](const auto&, const auto&) { return 0; };

}  // namespace

struct GatewayWatch::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, boost::asio::any_io_executor own_executor,
       GatewayWatchListener& own_listener, Of own_kind)
      : participant(own_participant),
        executor(std::move(own_executor)),
        listener(&own_listener),
        of(own_kind) {}

  void open();
  void watch_channels();
  void close();
  void drain_machines();
  void drain_channels();
  void listen_for_losses(dds_listener_t* on_machine);
  void take(const wire::Taken<MachineStatus>& taken);
  void take(const wire::Taken<ChannelStatus>& taken);
  void take_lost_writers();
  void lose(const ClaimKey& key, MachineClaim& claim);
  /// Whose certificates have been taken back since: what they have said holds no more.
  void drop_revoked();
  void complain(const std::string& kind, const std::string& about, const std::string& text);
  template <typename IsGone>
  void forget_channels(const IsGone& is_gone);
  /// Others speak for channels since claims have changed.
  void settle_channels();
  void ignore(Handle writer, const std::string& program, const std::string& what);
  /// The participant's first claim of this channel that holds, or the end of time.
  [[nodiscard]] Time claimed(Handle participant, const ChannelKey& key);
  /// `use(claim)` for each claim of this machine.
  template <typename Use>
  void for_claims(const std::string& machine, const Use& use) {
    claims.each_from({machine, {}}, [&](const ClaimKey& key, Claims::Word& word) {
      const bool same = key.first == machine;
      if (same) {
        use(word.value);
      }
      return same;
    });
  }
  [[nodiscard]] auto by_claim() {
    return [this](const ChannelKey& key, const Channels::Word& word) {
      return claimed(word.value.participant, key);
    };
  }

  /// Calls the listener, which may end this watch in any of its functions.
  template <typename Tell>
  void tell(Tell tell) {
    if (listener != nullptr) {
      tell();
    }
  }

  dds::Participant& participant;
  boost::asio::any_io_executor executor;
  /// Null once the watch is closed.
  GatewayWatchListener* listener;
  const Of of;
  // Before the readers that wake them.
  std::optional<dds::PostOnce> machine_post;
  std::optional<dds::PostOnce> channel_post;
  std::optional<dds::Badges::Watcher> badges;
  Claims claims;
  bool claims_differ = false;
  /// What gateways say of channels; of all only.
  Channels words;
  Complaints complaints;
  std::mutex lock;
  /// Writers that are gone or taken for gone; with the lock, since Cyclone's threads add to it. DDS
  /// says that of each writer, while the state of an instance is one for all who write its key.
  std::vector<Handle> lost_writers;
  std::optional<wire::Reader<MachineStatus>> machines;
  std::optional<wire::Reader<ChannelStatus>> channels;
};

void GatewayWatch::Impl::open() {
  machine_post.emplace(executor, weak_from_this(), [this] { drain_machines(); });
  const dds::Listener on_machine(dds_create_listener(nullptr));
  machine_post->listen_for_data(on_machine.get());
  listen_for_losses(on_machine.get());
  machines.emplace(
      participant, participant.options().fabric, of == Of::all ? wire::Keep::all : wire::Keep::last,
      wire::EndpointOptions{.listener = on_machine.get(), .others_only = of == Of::others});
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
  if (of == Of::all) {
    listen_for_losses(on_channel.get());
  }
  // Several gateways may have spoken of one channel, and the newest word need not be the one that
  // counts.
  channels.emplace(
      participant, participant.options().fabric, wire::Keep::all,
      wire::EndpointOptions{.listener = on_channel.get(), .others_only = of == Of::others});
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
    if (const auto flood = machines->take_flooding()) {
      complain("keys", *flood, *flood);
    }
    if (batch.empty()) {
      take_lost_writers();
      drop_revoked();
      settle_channels();
      return;
    }
    for (const wire::Taken<MachineStatus>& taken : batch) {
      tell([&] { take(taken); });
    }
  }
}

/// That a gateway is gone is not for another one to say. None ever disposes its key, so an instance
/// that is disposed says nothing, also one that a sample of its gateway shows.
void GatewayWatch::Impl::take(const wire::Taken<MachineStatus>& taken) {
  const MachineStatus& status = taken.value;
  const ClaimKey key(status.machine, status.gateway);
  Claims::Word* const known = claims.find(key);
  if (taken.presence == wire::Presence::orphaned) {
    if (known != nullptr) {
      lose(key, known->value);
    } else if (taken.valid) {
      listener->on_machine_gone(key.first, key.second);
    }
    return;
  }
  if (!taken.valid) {
    return;
  }
  claims_differ = true;
  const bool had_claimed = known != nullptr && known->value.status.claimed != Time{};
  if (had_claimed && known->writer == taken.writer && status.claimed == Time{}) {
    lose(key, known->value);
    claims.forget(key);
  } else if (claims.said(key, taken.writer, {machines->participant_of(taken.writer), status},
                         first_come)) {
    listener->on_machine(status);
  } else {
    ignore(taken.writer, machines->program_of(taken.writer),
           fmt::format("says what gateway {} of {} does", status.gateway.to_string(),
                       base::text::safe(status.machine)));
  }
}

void GatewayWatch::Impl::lose(const ClaimKey& key, MachineClaim& claim) {
  claims_differ = true;
  if (!std::exchange(claim.lost, true)) {
    tell([&] { listener->on_machine_gone(key.first, key.second); });
  }
}

void GatewayWatch::Impl::ignore(Handle writer, const std::string& program,
                                const std::string& what) {
  complain(
      "speaker", std::to_string(writer),
      fmt::format("participant {} {}, which is another's to say: that is ignored", program, what));
}

void GatewayWatch::Impl::complain(const std::string& kind, const std::string& about,
                                  const std::string& text) {
  if (const auto line = complaints.note(kind, about, text, std::chrono::steady_clock::now())) {
    tell([&] { listener->on_ignored(*line); });
  }
}

void GatewayWatch::Impl::listen_for_losses(dds_listener_t* listener_of_reader) {
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
  dds_lset_liveliness_changed_arg(listener_of_reader, add, this, true);
}

void GatewayWatch::Impl::take_lost_writers() {
  std::vector<Handle> lost;
  {
    const std::lock_guard guard(lock);
    lost.swap(lost_writers);
  }
  if (lost.empty() || listener == nullptr) {
    return;
  }
  const std::vector<Handle> there = machines->matched();
  const std::vector<Handle> channels_there = channels ? channels->matched() : std::vector<Handle>{};
  const auto is_gone_from = [](const std::vector<Handle>& matched) {
    return [&matched](Handle writer) { return std::ranges::count(matched, writer) == 0; };
  };
  claims.each_from({}, [&](const ClaimKey& key, Claims::Word& word) {
    if (std::ranges::count(lost, word.writer) > 0) {
      lose(key, word.value);
    }
    return listener != nullptr;
  });
  claims.forget(is_gone_from(there));
  forget_channels(is_gone_from(channels_there));
}

void GatewayWatch::Impl::drop_revoked() {
  if (!badges || badges->take().empty()) {
    return;
  }
  const auto revoked = [this](Handle writer) {
    return participant.badges()->of_writer(writer).revoked;
  };
  claims.each_from({}, [&](const ClaimKey& key, Claims::Word& word) {
    if (revoked(word.writer)) {
      lose(key, word.value);
    }
    return listener != nullptr;
  });
  claims.forget(revoked);
  forget_channels(revoked);
}

void GatewayWatch::Impl::drain_channels() {
  while (listener != nullptr && channels) {
    const auto batch = channels->take();
    if (const auto flood = channels->take_flooding()) {
      complain("keys", *flood, *flood);
    }
    if (batch.empty()) {
      return;
    }
    for (const wire::Taken<ChannelStatus>& taken : batch) {
      tell([&] { take(taken); });
    }
  }
}

void GatewayWatch::Impl::take(const wire::Taken<ChannelStatus>& taken) {
  const ChannelKey& key = taken.value.key;
  // A gateway weighs itself what others have said of a channel.
  if (of == Of::others) {
    if (taken.valid) {
      listener->on_channel(taken.value);
    }
    return;
  }
  if (taken.valid &&
      words.said(key, taken.writer, {channels->participant_of(taken.writer), taken.value},
                 by_claim())) {
    listener->on_channel(taken.value);
  } else if (taken.valid) {
    ignore(taken.writer, channels->program_of(taken.writer),
           "tells of " + base::text::safe(key.to_string()));
  }
  if (taken.presence == wire::Presence::orphaned && words.find(key) != nullptr) {
    words.forget(key);
    tell([&] { listener->on_channel_gone(key); });
  }
}

Time GatewayWatch::Impl::claimed(Handle who, const ChannelKey& key) {
  Time first = Time::max();
  for_claims(std::string(machine_of(key.machine)), [&](const MachineClaim& claim) {
    if (claim.participant == who && !claim.lost && is_plausible_claim(claim.status.claimed) &&
        covers(claim.status, key)) {
      first = std::min(first, claim.status.claimed);
    }
  });
  return first;
}

void GatewayWatch::Impl::settle_channels() {
  if (!std::exchange(claims_differ, false)) {
    return;
  }
  for (const ChannelKey& key : words.settle(by_claim())) {
    tell([&] { listener->on_channel(words.find(key)->value.status); });
  }
}

/// Who claims the channel speaks for it then; if none does, no one.
template <typename IsGone>
void GatewayWatch::Impl::forget_channels(const IsGone& is_gone) {
  const std::vector<ChannelKey> changed = words.forget(is_gone);
  words.settle(by_claim());
  for (const ChannelKey& key : changed) {
    const Channels::Word* const next = words.find(key);
    if (next != nullptr && claimed(next->value.participant, key) < Time::max()) {
      tell([&] { listener->on_channel(next->value.status); });
    } else {
      words.forget(key);
      tell([&] { listener->on_channel_gone(key); });
    }
  }
}

GatewayWatch::GatewayWatch(dds::Participant& participant, boost::asio::any_io_executor executor,
                           GatewayWatchListener& listener, Of of)
    : impl_(std::make_shared<Impl>(participant, std::move(executor), listener, of)) {
  impl_->open();
}

GatewayWatch::~GatewayWatch() {
  impl_->close();
}

void GatewayWatch::watch_channels() {
  impl_->watch_channels();
}

void GatewayWatch::drain() {
  const auto alive = impl_;
  alive->drain_machines();
}

bool GatewayWatch::is_gateway(registry::EndpointHandle participant,
                              const InstanceId& gateway) const {
  bool is = false;
  impl_->claims.each_from({}, [&](const ClaimKey& key, const Claims::Word& word) {
    is = key.second == gateway && word.value.participant == participant &&
         participant != DDS_HANDLE_NIL;
    return !is;
  });
  return is;
}

bool GatewayWatch::claims(registry::EndpointHandle participant, const std::string& machine) const {
  bool does = false;
  impl_->for_claims(std::string(machine_of(machine)), [&](const MachineClaim& claim) {
    does = does || (claim.participant == participant && participant != DDS_HANDLE_NIL);
  });
  return does;
}

std::optional<bool> GatewayWatch::has_epoch(registry::EndpointHandle participant,
                                            const std::string& machine, std::uint64_t epoch) const {
  std::optional<bool> has;
  impl_->for_claims(std::string(machine_of(machine)), [&](const MachineClaim& claim) {
    if (claim.status.epoch == epoch && !claim.lost) {
      has = has.value_or(false) || claim.participant == participant;
    }
  });
  return has;
}

std::uint64_t GatewayWatch::lost() const {
  return impl_->machines->lost() + (impl_->channels ? impl_->channels->lost() : 0);
}

}  // namespace millrace::fabric::ends
