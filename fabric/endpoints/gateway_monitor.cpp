#include "fabric/endpoints/gateway_monitor.hpp"

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "base/program/barrier.hpp"
#include "base/text/quoted.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/dds/authenticator.hpp"
#include "fabric/endpoints/tell.hpp"
#include "fabric/key_owners.hpp"
#include "fabric/log_limiter.hpp"
#include "fabric/wire/subscription.hpp"

namespace millrace::fabric::endpoints {

namespace {

using Handle = dds_instance_handle_t;
/// By machine and gateway.
using ClaimKey = std::pair<std::string, InstanceId>;

struct MachineClaim {
  Handle participant = DDS_HANDLE_NIL;
  MachineStatus status{};
  /// The gateway's id names this participant as its maker.
  bool made_id = false;
  /// Its writer counts as gone.
  std::optional<Absence> lost{};
};
struct OwnedChannel {
  Handle participant = DDS_HANDLE_NIL;
  ChannelStatus status{};
};
using Claims = KeyOwners<ClaimKey, MachineClaim>;
using Channels = KeyOwners<ChannelKey, OwnedChannel>;

bool is_in(const std::vector<Handle>& writers, Handle writer) {
  return std::ranges::find(writers, writer) != writers.end();
}

bool covers(const MachineStatus& status, const ChannelKey& key) {
  const bool queue = machine_of(key.machine) != key.machine;
  return queue || status.claims.empty() || std::ranges::count(status.claims, key.channel) > 0;
}

/// Only a gateway publishes about itself, also while it is taken for gone: the maker of the id, or
/// the first that uses it.
constexpr auto by_maker = [](const ClaimKey&, const Claims::Sample& sample) {
  return sample.value.made_id ? 0 : 1;
};

}  // namespace

struct GatewayMonitor::Impl : std::enable_shared_from_this<Impl> {
  Impl(dds::Participant& own_participant, boost::asio::any_io_executor own_executor,
       GatewayMonitorListener& own_listener, Of own_kind)
      : participant(own_participant),
        executor(std::move(own_executor)),
        listener(&own_listener),
        of(own_kind) {}

  void open();
  void subscribe_channels();
  void close();
  void drain();
  [[nodiscard]] wire::SubscriptionOptions options(wire::Keep keep, const dds_listener_t* on_loss);
  void listen_for_losses(dds_listener_t* on_loss);
  void take(const wire::Taken<MachineStatus>& taken);
  void take(const wire::Taken<ChannelStatus>& taken);
  void take_lost_writers();
  void lose(const ClaimKey& key, MachineClaim& claim, Absence absence);
  /// Removes the samples of revoked participants.
  void drop_revoked();
  void warn_limited(const std::string& kind, const std::string& about, const std::string& text);
  /// Reports the claims of lost writers, and removes the samples of those that have left.
  template <typename IsLost, typename HasLeft, typename ChannelHasLeft>
  void forget(const IsLost& is_lost, const HasLeft& has_left,
              const ChannelHasLeft& channel_has_left);
  template <typename IsGone>
  void forget_channels(const IsGone& is_gone);
  /// Updates the owners of channels after claims have changed.
  void settle_channels();
  void ignore(Handle writer, const std::string& program, const std::string& what);
  /// The participant's first claim of this channel that holds, or the end of time.
  [[nodiscard]] Time claimed(Handle participant, const ChannelKey& key);
  /// `use(claim)` for each claim of this machine.
  template <typename Use>
  void for_claims(const std::string& machine, const Use& use) {
    claims.each_from({machine, {}}, [&](const ClaimKey& key, Claims::Sample& sample) {
      const bool same = key.first == machine;
      if (same) {
        use(sample.value);
      }
      return same;
    });
  }
  [[nodiscard]] auto by_claim() {
    return [this](const ChannelKey& key, const Channels::Sample& sample) {
      return claimed(sample.value.participant, key);
    };
  }

  dds::Participant& participant;
  boost::asio::any_io_executor executor;
  /// Null once the watch is closed.
  GatewayMonitorListener* listener;
  const Of of;
  // Before the subscriptions that wake them.
  std::optional<dds::PostOnce> machine_post;
  std::optional<dds::PostOnce> channel_post;
  std::optional<dds::Authenticator::ChangeQueue> identity_changes;
  Claims claims;
  bool claims_differ = false;
  /// What gateways publish about channels; only if all channels are wanted.
  Channels owned_channels;
  LogLimiter log_limiter;
  std::mutex lock;
  /// Writers that are gone or taken for gone; locked, since Cyclone's threads add to it. DDS
  /// reports that for each writer, while the instance state covers all writers of a key.
  std::vector<Handle> lost_writers;
  wire::Subscription<MachineStatus> machines;
  wire::Subscription<ChannelStatus> channels;
};

void GatewayMonitor::Impl::open() {
  machine_post.emplace(executor, weak_from_this(), [this] { drain(); });
  const dds::Listener on_loss(dds_create_listener(nullptr));
  listen_for_losses(on_loss.get());
  machines = wire::Subscription<MachineStatus>(
      participant, *machine_post, participant.options().fabric,
      [this](const wire::Taken<MachineStatus>& taken) { take(taken); },
      options(of == Of::all ? wire::Keep::all : wire::Keep::last, on_loss.get()));
  if (participant.authenticator() != nullptr) {
    identity_changes.emplace(*participant.authenticator(), [this] { machine_post->post(); });
  }
}

void GatewayMonitor::Impl::subscribe_channels() {
  if (channels) {
    return;
  }
  channel_post.emplace(executor, weak_from_this(), [this] { channels.drain(); });
  const dds::Listener on_loss(dds_create_listener(nullptr));
  if (of == Of::all) {
    listen_for_losses(on_loss.get());
  }
  // Several gateways may have published one channel, and the newest sample need not be the
  // effective one.
  channels = wire::Subscription<ChannelStatus>(
      participant, *channel_post, participant.options().fabric,
      [this](const wire::Taken<ChannelStatus>& taken) { take(taken); },
      options(wire::Keep::all, on_loss.get()));
}

wire::SubscriptionOptions GatewayMonitor::Impl::options(wire::Keep keep,
                                                        const dds_listener_t* on_loss) {
  return {.keep = keep,
          .endpoint = {.listener = on_loss, .others_only = of == Of::others},
          .on_flooding = [this](const std::string& line) { warn_limited("keys", line, line); }};
}

void GatewayMonitor::Impl::close() {
  listener = nullptr;
  identity_changes.reset();
  machines.reset();
  channels.reset();
}

void GatewayMonitor::Impl::drain() {
  // The last samples come first: the end of a gateway is judged by them.
  channels.drain();
  machines.drain();
  take_lost_writers();
  drop_revoked();
  settle_channels();
}

/// No other gateway can publish that a gateway is gone. None ever disposes its key, so a disposed
/// instance means nothing, also one that a sample of its gateway shows.
void GatewayMonitor::Impl::take(const wire::Taken<MachineStatus>& taken) {
  const MachineStatus& status = taken.value;
  const ClaimKey key(status.machine, status.gateway);
  Claims::Sample* const known = claims.find(key);
  // With the last sample DDS may report already that the key has no writer any more.
  if (taken.valid && known != nullptr && known->writer == taken.writer &&
      known->value.status.claimed != Time{} && status.claimed == Time{}) {
    lose(key, known->value,
         base::messages::machine_removed.is(status.reason) ? Absence::removed : Absence::ended);
    claims.forget(key);
    return;
  }
  if (taken.instance_state == wire::InstanceState::no_writers) {
    const std::vector<Handle> there = machines->matched();
    const Absence absence = is_in(there, known != nullptr ? known->writer : taken.writer)
                                ? Absence::silent
                                : Absence::gone;
    if (known != nullptr) {
      lose(key, known->value, absence);
    } else if (taken.valid) {
      listener->on_machine_gone(key.first, key.second, absence);
    }
    return;
  }
  if (!taken.valid) {
    return;
  }
  claims_differ = true;
  if (claims.update(key, taken.writer,
                    {machines->participant_of(taken.writer), status,
                     machines->made_id(taken.writer, status.gateway)},
                    by_maker)) {
    listener->on_machine(status);
  } else {
    ignore(taken.writer, machines->program_of(taken.writer),
           fmt::format("publishes the state of gateway {} of {}", status.gateway.to_string(),
                       base::text::safe(status.machine)));
  }
}

void GatewayMonitor::Impl::lose(const ClaimKey& key, MachineClaim& claim, Absence absence) {
  claims_differ = true;
  // DDS takes a process for gone much later than its writers for silent.
  if (!claim.lost && absence == Absence::gone) {
    absence = Absence::ended;
  }
  if (!claim.lost || (claim.lost == Absence::silent && absence != Absence::silent)) {
    claim.lost = absence;
    tell(listener, &GatewayMonitorListener::on_machine_gone, key.first, key.second, absence);
  }
}

void GatewayMonitor::Impl::ignore(Handle writer, const std::string& program,
                                  const std::string& what) {
  warn_limited("speaker", std::to_string(writer),
               fmt::format("participant {} {}, which belongs to another participant; ignored",
                           program, what));
}

void GatewayMonitor::Impl::warn_limited(const std::string& kind, const std::string& about,
                                        const std::string& text) {
  if (const auto line = log_limiter.admit(kind, about, text, std::chrono::steady_clock::now())) {
    tell(listener, &GatewayMonitorListener::on_ignored, *line);
  }
}

void GatewayMonitor::Impl::listen_for_losses(dds_listener_t* on_loss) {
  const auto add = [](dds_entity_t, const dds_liveliness_changed_status_t status,
                      void* self) noexcept {
    auto& impl = *static_cast<Impl*>(self);
    // A writer fell silent, or one that was silent is gone.
    if (status.alive_count_change < 0 ||
        (status.alive_count_change == 0 && status.not_alive_count_change < 0)) {
      base::program::contain("processing the end of a gateway", [&] {
        const std::lock_guard guard(impl.lock);
        impl.lost_writers.push_back(status.last_publication_handle);
      });
      impl.machine_post->post();
    }
  };
  dds_lset_liveliness_changed_arg(on_loss, add, this, true);
}

void GatewayMonitor::Impl::take_lost_writers() {
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
    return [&matched](Handle writer) { return !is_in(matched, writer); };
  };
  forget([&](Handle writer) { return is_in(lost, writer); }, is_gone_from(there),
         is_gone_from(channels_there));
}

void GatewayMonitor::Impl::drop_revoked() {
  if (!identity_changes || identity_changes->take().empty()) {
    return;
  }
  const auto revoked = [this](Handle writer) {
    return participant.authenticator()->of_writer(writer).revoked;
  };
  forget(revoked, revoked, revoked);
}

template <typename IsLost, typename HasLeft, typename ChannelHasLeft>
void GatewayMonitor::Impl::forget(const IsLost& is_lost, const HasLeft& has_left,
                                  const ChannelHasLeft& channel_has_left) {
  claims.each_from({}, [&](const ClaimKey& key, Claims::Sample& sample) {
    if (has_left(sample.writer)) {
      lose(key, sample.value, Absence::gone);
    } else if (is_lost(sample.writer)) {
      lose(key, sample.value, Absence::silent);
    }
    return listener != nullptr;
  });
  claims.forget(has_left);
  forget_channels(channel_has_left);
}

void GatewayMonitor::Impl::take(const wire::Taken<ChannelStatus>& taken) {
  const ChannelKey& key = taken.value.key;
  // A gateway itself evaluates what others have published about a channel.
  if (of == Of::others) {
    if (taken.valid) {
      listener->on_channel(taken.value);
    }
    return;
  }
  if (taken.valid &&
      owned_channels.update(key, taken.writer,
                            {channels->participant_of(taken.writer), taken.value}, by_claim())) {
    listener->on_channel(taken.value);
  } else if (taken.valid) {
    ignore(taken.writer, channels->program_of(taken.writer),
           "tells of " + base::text::safe(key.to_string()));
  }
  if (taken.instance_state == wire::InstanceState::no_writers &&
      owned_channels.find(key) != nullptr) {
    owned_channels.forget(key);
    tell(listener, &GatewayMonitorListener::on_channel_gone, key);
  }
}

Time GatewayMonitor::Impl::claimed(Handle who, const ChannelKey& key) {
  Time first = Time::max();
  for_claims(std::string(machine_of(key.machine)), [&](const MachineClaim& claim) {
    if (claim.participant == who && !claim.lost && is_plausible_claim(claim.status.claimed) &&
        covers(claim.status, key)) {
      first = std::min(first, claim.status.claimed);
    }
  });
  return first;
}

void GatewayMonitor::Impl::settle_channels() {
  if (!std::exchange(claims_differ, false)) {
    return;
  }
  for (const ChannelKey& key : owned_channels.rank_again(by_claim())) {
    tell(listener, &GatewayMonitorListener::on_channel, owned_channels.find(key)->value.status);
  }
}

/// The gateway that claims the channel owns it then; if none does, the channel has no owner.
template <typename IsGone>
void GatewayMonitor::Impl::forget_channels(const IsGone& is_gone) {
  std::vector<ChannelKey> changed = owned_channels.forget(is_gone);
  // A silent gateway loses its channels to another one whose samples are here already.
  for (const ChannelKey& key : owned_channels.rank_again(by_claim())) {
    if (std::ranges::find(changed, key) == changed.end()) {
      changed.push_back(key);
    }
  }
  for (const ChannelKey& key : changed) {
    const Channels::Sample* const next = owned_channels.find(key);
    if (next != nullptr && claimed(next->value.participant, key) < Time::max()) {
      tell(listener, &GatewayMonitorListener::on_channel, next->value.status);
    } else {
      owned_channels.forget(key);
      tell(listener, &GatewayMonitorListener::on_channel_gone, key);
    }
  }
}

GatewayMonitor::GatewayMonitor(dds::Participant& participant, boost::asio::any_io_executor executor,
                               GatewayMonitorListener& listener, Of of)
    : impl_(std::make_shared<Impl>(participant, std::move(executor), listener, of)) {
  impl_->open();
}

GatewayMonitor::~GatewayMonitor() {
  impl_->close();
}

void GatewayMonitor::subscribe_channels() {
  impl_->subscribe_channels();
}

void GatewayMonitor::drain() {
  const auto alive = impl_;
  alive->drain();
}

bool GatewayMonitor::is_gateway(registry::EndpointHandle participant,
                                const InstanceId& gateway) const {
  // A gateway of another machine can publish this id as its own.
  bool is = false;
  bool is_maker = false;
  bool has_maker = false;
  impl_->claims.each_from({}, [&](const ClaimKey& key, const Claims::Sample& sample) {
    if (key.second == gateway && sample.value.participant != DDS_HANDLE_NIL) {
      const bool same = sample.value.participant == participant;
      is = is || same;
      is_maker = is_maker || (same && sample.value.made_id);
      has_maker = has_maker || sample.value.made_id;
    }
    return true;
  });
  return has_maker ? is_maker : is;
}

bool GatewayMonitor::claims(registry::EndpointHandle participant,
                            const std::string& machine) const {
  bool does = false;
  impl_->for_claims(std::string(machine_of(machine)), [&](const MachineClaim& claim) {
    does = does || (claim.participant == participant && participant != DDS_HANDLE_NIL);
  });
  return does;
}

std::optional<bool> GatewayMonitor::has_epoch(registry::EndpointHandle participant,
                                              const std::string& machine,
                                              std::uint64_t epoch) const {
  std::optional<bool> has;
  impl_->for_claims(std::string(machine_of(machine)), [&](const MachineClaim& claim) {
    if (claim.status.epoch == epoch && !claim.lost) {
      has = has.value_or(false) || claim.participant == participant;
    }
  });
  return has;
}

std::uint64_t GatewayMonitor::lost() const {
  return impl_->machines->lost() + (impl_->channels ? impl_->channels->lost() : 0);
}

}  // namespace millrace::fabric::endpoints
