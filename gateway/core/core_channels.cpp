// Which channels have a session. Those of a controller begin with its link and end when the
// configuration no longer names them or another gateway serves them. Those of message queues begin
// and end with their queues.
#include <utility>

#include "gateway/core/core.hpp"

namespace millrace::gateway::core {

namespace {

void add(CallCounts& counts, const fabric::ChannelStatus& status) {
  counts.answered += status.answered;
  counts.failed += status.failed;
  counts.withdrawn += status.withdrawn;
}

}  // namespace

CallCounts Core::counts() const {
  CallCounts counts = left_counts_;
  for (const auto& [key, session] : sessions_) {
    add(counts, session.status());
  }
  return counts;
}

channel::ChannelSession* Core::find(const fabric::ChannelKey& key) {
  const auto found = index_.find(key);
  return found == index_.end() ? nullptr : found->second;
}

channel::ChannelSession& Core::open(const fabric::ChannelKey& key) {
  std::shared_ptr<WriteEffects>& effects = effects_[key.machine];
  if (effects == nullptr) {
    effects = std::make_shared<WriteEffects>();
  }
  channel::ChannelSession& session =
      sessions_.try_emplace(key, key, context_, pace_of(key.machine), effects).first->second;
  index_[key] = &session;
  return session;
}

Pace Core::pace_of(const std::string& machine) const {
  const auto pace = paces_.find(machine);
  return pace == paces_.end() ? Pace{} : pace->second;
}

void Core::link_up(const std::string& machine, const machines::Channels& channels) {
  for (const std::uint16_t channel : channels) {
    reserve_numbers();
    channel::ChannelSession& session = open({machine, channel});
    if (session.retired()) {
      leaving_.erase(session.key());
      session.keep(now_);
      follow(session);
    }
    if (!session.link_up()) {
      session.on_link_up(now_);
      follow(session);
    }
  }
  for (const fabric::ChannelKey& key : leaving_) {
    channel::ChannelSession& session = sessions_.at(key);
    if (key.machine == machine && !session.link_up()) {
      session.on_link_up(now_);
      follow(session);
    }
  }
  remove_left_channels();
}

/// When one of them frees an instance, another one gets it: none may then ask anything of the link.
template <typename End>
void Core::lose_link(const std::string& machine, End end) {
  for (auto& [key, session] : sessions_) {
    if (key.machine == machine) {
      session.lose_link();
    }
  }
  for (auto& [key, session] : sessions_) {
    if (key.machine == machine) {
      end(session);
      follow(session);
    }
  }
  remove_left_channels();
}

void Core::link_down(const std::string& machine, const std::string& reason) {
  lose_link(machine, [&](channel::ChannelSession& session) { session.on_link_down(reason, now_); });
}

void Core::on_serve(const std::string& machine, const machines::Channels& channels) {
  queues_.on_up(machine, channels, *machines_.link_of(machine), now_);
  link_up(machine, channels);
}

void Core::on_lost(const std::string& machine, const std::string& reason) {
  link_down(machine, reason);
  queues_.on_down(machine, reason);
}

void Core::on_link_dropped(const std::string& machine, const std::string& reason) {
  lose_link(machine,
            [&](channel::ChannelSession& session) { session.on_link_dropped(reason, now_); });
  queues_.on_link_gone(machine, reason);
}

void Core::on_retired(const fabric::ChannelKey& key) {
  retire(key);
  queues_.on_left(key.machine, key.channel, "the configuration names its channel no more");
}

void Core::retire(const fabric::ChannelKey& key) {
  if (channel::ChannelSession* session = find(key)) {
    leaving_.insert(key);
    session->retire(now_);
    follow(*session);
  }
  remove_left_channels();
}

void Core::on_refused(const fabric::ChannelKey& key, const std::string& reason) {
  if (channel::ChannelSession* session = find(key)) {
    leaving_.insert(key);
    if (session->may_be_given()) {
      // The other may never take it up before we serve the channel again.
      const Call* call = session->call();
      remember(key, {call->request.uuid, "this gateway, which had left the channel to another one",
                     call->id});
    }
    session->hand_over(reason, now_);
    follow(*session);
  }
  remove_left_channels();
  queues_.on_left(key.machine, key.channel, reason);
}

void Core::on_inherited(const fabric::ChannelStatus& status, const std::string& from) {
  remember(status.key, {status.uuid, from, status.call});
}

void Core::on_pushed(const fabric::ChannelKey& key, bool pushed) {
  step(key, [&](channel::ChannelSession& session) { session.set_told(pushed, now_); });
}

void Core::on_change(const fabric::ChannelKey& key, Variable variable) {
  step(key, [&](channel::ChannelSession& session) { session.on_change(variable, now_); });
}

void Core::remember(const fabric::ChannelKey& key, PredecessorCall call) {
  if (call.call.epoch != numbers_.epoch()) {
    context_.predecessors[key] = call.call.epoch;
  }
  predecessors_.add(key, std::move(call));
}

machines::Channels Core::channels_of(const std::string& machine) const {
  machines::Channels channels;
  for (const auto& [key, session] : sessions_) {
    if (key.machine == machine) {
      channels.push_back(key.channel);
    }
  }
  return channels;
}

void Core::remove_left_channels() {
  for (auto it = leaving_.begin(); it != leaving_.end();) {
    if (sessions_.at(*it).is_over()) {
      dispose(context_.answered.take(*it));
      add(left_counts_, sessions_.at(*it).status());
      dispose(*it);
      context_.standing.forget(*it);
      timers_.remove(*it);
      index_.erase(*it);
      context_.predecessors.erase(*it);
      sessions_.erase(*it);
      it = leaving_.erase(it);
    } else {
      ++it;
    }
  }
}

void Core::dispose(const std::vector<fabric::RequestKey>& requests) {
  for (const fabric::RequestKey& request : requests) {
    dispose(request);
  }
}

bool Core::tell_of_queues() {
  bool some = false;
  while (const auto event = queues_.next_event()) {
    some = true;
    const fabric::ChannelKey& key = event->key;
    switch (event->kind) {
      using enum MessageQueues::ChannelEvent::Kind;
      case opened:
        link_up(key.machine, {key.channel});
        // Whatever changes there, we do.
        on_pushed(key, true);
        break;
      case down:
        link_down(key.machine, event->reason);
        break;
      case retired:
        retire(key);
        break;
      case read:
        on_queue_read(key, event->shown);
        break;
      case written:
        step(key, [&](channel::ChannelSession& session) {
          session.on_write(WriteOutcome::written, "", now_);
        });
        break;
      case changed:
        on_change(key, Variable::request_state);
        break;
    }
    queues_.on_event_told(*event);
  }
  return some;
}

void Core::on_queue_read(const fabric::ChannelKey& key, const Snapshot& snapshot) {
  read_channel(key, snapshot);
}

}  // namespace millrace::gateway::core
