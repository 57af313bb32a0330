#include "fabric/ends/roster.hpp"

#include <utility>

namespace millrace::fabric::ends {

namespace {

SteadyTime now() {
  return std::chrono::steady_clock::now();
}

}  // namespace

void Roster::open(const dds::Participant& participant, std::weak_ptr<void> alive,
                  dds::PostOnce& on_endpoint, dds::PostOnce& on_beat) {
  alive_ = std::move(alive);
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
  beats_.reset();
  discovery_.reset();
}

Discovery::News Roster::look_around() {
  return discovery_ ? discovery_->drain(registry_, now()) : Discovery::News{};
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
  registry_.stood_still(now() - due);
  owner_.drain_beats();
  registry_.on_time(now());
  owner_.announce();
}

}  // namespace millrace::fabric::ends
