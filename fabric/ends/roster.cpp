#include "fabric/ends/roster.hpp"

#include <utility>

#include <fmt/format.h>

#include "base/text/quoted.hpp"

namespace millrace::fabric::ends {

namespace {

/// A timer that rings so late says that this process got no processor: its threads that receive may
/// not have got one either.
constexpr std::chrono::milliseconds stall{50};

SteadyTime now() {
  return std::chrono::steady_clock::now();
}

}  // namespace

void Roster::open(const dds::Participant& participant, std::weak_ptr<void> alive,
                  dds::PostOnce& on_endpoint, dds::PostOnce& on_beat) {
  alive_ = std::move(alive);
  on_endpoint_ = &on_endpoint;
  badges_ = participant.badges();
  if (badges_ != nullptr) {
    registry_.ask_for_names();
    proofs_.emplace(*badges_, [&on_endpoint] { on_endpoint.post(); });
  }
  const dds::Listener beat_listener(dds_create_listener(nullptr));
  on_beat.listen_for_data(beat_listener.get());
  beats_.emplace(participant, participant.options().fabric, wire::Keep::last,
                 wire::EndpointOptions{.listener = beat_listener.get()});

  const dds::Listener endpoint_listener(dds_create_listener(nullptr));
  on_endpoint.listen_for_data(endpoint_listener.get());
  discovery_.emplace(participant, endpoint_listener.get());
}

void Roster::close() {
  silence_.cancel();
  proofs_.reset();
  beats_.reset();
  discovery_.reset();
}

Discovery::News Roster::look_around() {
  if (!discovery_) {
    return {};
  }
  Discovery::News news = discovery_->drain(registry_, now());
  if (proofs_) {
    look_at_badges(news);
  }
  if (const auto flood = std::exchange(flooding_, std::nullopt)) {
    news.ignored.push_back({"keys", *flood, *flood});
  }
  return news;
}

void Roster::look_at_badges(Discovery::News& news) {
  for (const dds_instance_handle_t participant : proofs_->take()) {
    const dds::Badges::Known known = badges_->look_up(participant);
    if (known.proof.revoked) {
      registry_.named(participant, std::nullopt);
      for (const InstanceId& instance : registry_.instances_of(participant)) {
        news.ignored.push_back(
            {"revoked", instance.to_string(),
             fmt::format("instance {} is put off: the certificate of {} has been revoked",
                         instance.to_string(), base::text::safe(known.proof.badge->name))});
      }
    } else if (!known.there) {
      registry_.name_gone(participant);
    } else if (known.proof.badge) {
      registry_.named(participant, known.proof.badge->name);
    }
  }
  for (const auto& [instance, uuid] : registry_.take_unproven()) {
    news.ignored.push_back(
        {"unproven", instance.to_string(),
         fmt::format(
             "instance {} of {} gets no calls: its program shows no badge of its "
             "certificate. It is of an earlier version (`millrace trust renew` its material "
             "and start it with this one), or of another vendor (docs/wire.md)",
             instance.to_string(), base::text::safe(uuid))});
  }
}

registry::Registry::Changes Roster::changes() {
  registry::Registry::Changes changes = registry_.changes();
  await_silence();
  return changes;
}

void Roster::await_silence() {
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

void Roster::on_silence(SteadyTime due) {
  silence_at_.reset();
  const SteadyTime at = now();
  at - due > stall ? registry_.start_over(at) : registry_.stood_still(at - due);
  owner_.drain_beats();
  registry_.on_time(now());
  if (proofs_) {
    // Who has proved nothing is told of in its turn.
    on_endpoint_->post();
  }
  owner_.announce();
}

}  // namespace millrace::fabric::ends
