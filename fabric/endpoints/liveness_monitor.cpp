#include "fabric/endpoints/liveness_monitor.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include <fmt/format.h>

#include "base/text/quoted.hpp"

namespace millrace::fabric::endpoints {

namespace {

/// A timer that is this late shows that the process got no processor time: its receiving threads
/// may not have got any either.
constexpr std::chrono::milliseconds stall{50};

SteadyTime now() {
  return std::chrono::steady_clock::now();
}

std::optional<bool> is_busy(const Heartbeat& heartbeat) {
  if (heartbeat.loads.empty()) {
    return std::nullopt;
  }
  return std::ranges::any_of(heartbeat.loads,
                             [](const InstanceLoad& load) { return !load.calls.empty(); });
}

}  // namespace

void LivenessMonitor::open(const dds::Participant& participant, Discovery::Of of,
                           std::weak_ptr<void> alive, dds::PostOnce& on_endpoint,
                           dds::PostOnce& on_heartbeat, int batches_per_turn) {
  alive_ = std::move(alive);
  on_endpoint_ = &on_endpoint;
  authenticator_ = participant.authenticator();
  if (authenticator_ != nullptr) {
    registry_.require_authentication();
    identity_changes_.emplace(*authenticator_, [&on_endpoint] { on_endpoint.post(); });
  }
  heartbeats_ =
      wire::Subscription<Heartbeat>(participant, on_heartbeat, participant.options().fabric,
                                    [this](const wire::Taken<Heartbeat>& taken) { take(taken); },
                                    {.keep = wire::Keep::last,
                                     .batches_per_turn = batches_per_turn,
                                     .on_flooding = [this](const std::string& line) {
                                       flooding_.insert(line);
                                       on_endpoint_->post();
                                     }});

  discovery_.emplace(participant, of, &on_endpoint);
}

void LivenessMonitor::close() {
  silence_.cancel();
  identity_changes_.reset();
  heartbeats_.reset();
  discovery_.reset();
}

void LivenessMonitor::take(const wire::Taken<Heartbeat>& taken) {
  const SteadyTime at = now();
  // It may be the first heartbeat of an unknown process; the next one follows.
  if (!taken.valid || !registry_.heartbeat(taken.writer, at, is_busy(taken.value))) {
    return;
  }
  for (const InstanceLoad& load : taken.value.loads) {
    owner_.on_load(taken.writer, load, registry_.heartbeats_for(taken.writer, load.status.instance),
                   at);
  }
}

Discovery::News LivenessMonitor::update() {
  if (!discovery_) {
    return {};
  }
  Discovery::News news = discovery_->drain(registry_, now());
  if (identity_changes_) {
    check_identities(news);
  }
  for (const std::string& flood : std::exchange(flooding_, {})) {
    news.ignored.push_back({"keys", flood, flood});
  }
  return news;
}

void LivenessMonitor::check_identities(Discovery::News& news) {
  for (const dds_instance_handle_t participant : identity_changes_->take()) {
    const dds::Authenticator::Known known = authenticator_->look_up(participant);
    if (known.status.revoked) {
      registry_.authenticated(participant, std::nullopt);
      for (const InstanceId& instance : registry_.instances_of(participant)) {
        news.ignored.push_back(
            {"revoked", instance.to_string(),
             fmt::format("instance {} gets no calls: the certificate of {} was revoked",
                         instance.to_string(), base::text::safe(known.status.identity->name))});
      }
    } else if (!known.there) {
      registry_.authenticated_gone(participant);
    } else if (known.status.identity) {
      registry_.authenticated(participant, known.status.identity->name);
    }
  }
  for (const auto& [instance, uuid] : registry_.take_unauthenticated()) {
    news.ignored.push_back(
        {"unauthenticated", instance.to_string(),
         fmt::format(
             "instance {} of {} gets no calls: its process announces no identity certificate. It "
             "runs an earlier version (renew its credentials with `millrace trust renew` and start "
             "it with this version), or another vendor's DDS (docs/reference/wire.md)",
             instance.to_string(), base::text::safe(uuid))});
  }
}

void LivenessMonitor::requested(const InstanceId& instance) {
  registry_.requested(instance, now());
  await_silence();
}

registry::InstanceRegistry::Changes LivenessMonitor::changes() {
  registry::InstanceRegistry::Changes changes = registry_.changes();
  await_silence();
  return changes;
}

void LivenessMonitor::await_silence() {
  const auto next = registry_.next_time();
  if (next == silence_at_) {
    return;
  }
  silence_at_ = next;
  silence_.cancel();
  if (!next) {
    return;
  }
  silence_.expires_at(*next);
  silence_.async_wait([this, alive = alive_, due = *next](boost::system::error_code error) {
    const auto owner = alive.lock();
    if (!error && owner && discovery_) {
      on_silence(due);
    }
  });
}

void LivenessMonitor::on_silence(SteadyTime due) {
  silence_at_.reset();
  const SteadyTime at = now();
  at - due > stall ? registry_.start_over(at) : registry_.stood_still(at - due);
  // After a pause of this process, an instance whose heartbeats waited in that time is not silent.
  drain_heartbeats();
  registry_.on_time(now());
  if (identity_changes_) {
    // A process without a proved identity is reported in its turn.
    on_endpoint_->post();
  }
  owner_.announce();
}

HeartbeatEndpoint::HeartbeatEndpoint(const dds::Participant& participant, const InstanceId& process)
    : writer_(participant, participant.options().fabric) {
  const auto held = writer_.hold({.process = process});
  assert(held);
  static_cast<void>(held);
}

}  // namespace millrace::fabric::endpoints
