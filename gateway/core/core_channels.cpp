// The set of channels. Those of a controller begin with its link and end when the configuration no
// longer names them or another gateway serves them. Those of message queues begin and end with
// their queues.
#include <utility>

#include "base/messages/catalogue.hpp"
#include "fabric/channel_scope.hpp"
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
  CallCounts counts = past_counts_;
  for (const auto& [key, channel] : channels_) {
    add(counts, channel.status());
  }
  return counts;
}

channel::Channel* Core::find(const fabric::ChannelKey& key) {
  const auto found = index_.find(key);
  return found == index_.end() ? nullptr : found->second;
}

channel::Channel& Core::open(const fabric::ChannelKey& key) {
  std::shared_ptr<WriteEffects>& effects = effects_[key.machine];
  if (effects == nullptr) {
    effects = std::make_shared<WriteEffects>();
  }
  channel::Channel& channel =
      channels_.try_emplace(key, key, access_of(key), context_, intervals_of(key.machine), effects)
          .first->second;
  index_[key] = &channel;
  return channel;
}

ServiceAccess& Core::access_of(const fabric::ChannelKey& key) {
  return fabric::queue_of(key.machine).empty() ? static_cast<ServiceAccess&>(machines_) : queues_;
}

ReadIntervals Core::intervals_of(const std::string& machine) const {
  const auto intervals = intervals_.find(machine);
  return intervals == intervals_.end() ? ReadIntervals{} : intervals->second;
}

void Core::link_up(const std::string& machine, const machines::Channels& channels) {
  for (const std::uint16_t number : channels) {
    reserve_numbers();
    channel::Channel& channel = open({machine, number});
    if (channel.draining()) {
      draining_.erase(channel.key());
      channel.resume_ownership(now_);
      follow(channel);
    }
    if (!channel.link_up()) {
      channel.on_link_up(now_);
      follow(channel);
    }
  }
  for (const fabric::ChannelKey& key : draining_) {
    channel::Channel& channel = channels_.at(key);
    if (key.machine == machine && !channel.link_up()) {
      channel.on_link_up(now_);
      follow(channel);
    }
  }
  remove_drained_channels();
}

/// When one of them frees an instance, another one gets it: none may then ask anything of the link.
template <typename End>
void Core::lose_link(const std::string& machine, End end) {
  for (auto& [key, channel] : channels_) {
    if (key.machine == machine) {
      channel.lose_link();
    }
  }
  for (auto& [key, channel] : channels_) {
    if (key.machine == machine) {
      end(channel);
      follow(channel);
    }
  }
  remove_drained_channels();
}

void Core::link_down(const std::string& machine, const fabric::Message& reason) {
  lose_link(machine, [&](channel::Channel& channel) { channel.on_link_down(reason, now_); });
}

void Core::on_serve(const std::string& machine, const machines::Channels& channels) {
  queues_.on_up(machine, channels, *machines_.link_of(machine), now_);
  link_up(machine, channels);
}

void Core::on_lost(const std::string& machine, const fabric::Message& reason) {
  link_down(machine, reason);
  queues_.on_down(machine, reason);
}

void Core::on_link_dropped(const std::string& machine, const fabric::Message& reason) {
  lose_link(machine, [&](channel::Channel& channel) { channel.on_link_dropped(reason, now_); });
  queues_.on_link_gone(machine, reason);
}

void Core::on_channel_removed(const fabric::ChannelKey& key) {
  drain(key);
  queues_.on_channel_lost(key.machine, key.channel, base::messages::channel_removed());
}

void Core::drain(const fabric::ChannelKey& key) {
  if (channel::Channel* channel = find(key)) {
    draining_.insert(key);
    channel->drain(now_);
    follow(*channel);
  }
  remove_drained_channels();
}

void Core::on_not_owner(const fabric::ChannelKey& key, const fabric::Message& reason) {
  if (channel::Channel* channel = find(key)) {
    draining_.insert(key);
    if (channel->may_be_assigned()) {
      // The other may never take it up before we serve the channel again.
      const CallRecord* call = channel->call();
      remember(key, {call->request.uuid, base::messages::this_gateway_before(), call->id});
    }
    channel->hand_over(reason, now_);
    follow(*channel);
  }
  remove_drained_channels();
  queues_.on_channel_lost(key.machine, key.channel, reason);
}

void Core::on_predecessor_call(const fabric::ChannelStatus& status, const std::string& from) {
  remember(status.key, {status.uuid, from, status.call});
}

void Core::on_trusted(const fabric::ChannelKey& key, bool trusted) {
  step(key, [&](channel::Channel& channel) { channel.set_notified(trusted, now_); });
}

void Core::on_change(const fabric::ChannelKey& key, Variable variable) {
  step(key, [&](channel::Channel& channel) { channel.on_change(variable, now_); });
}

void Core::remember(const fabric::ChannelKey& key, PredecessorCall call) {
  if (call.call.epoch != numbers_.epoch()) {
    context_.predecessor_epochs[key] = call.call.epoch;
  }
  predecessors_.add(key, std::move(call));
}

machines::Channels Core::channels_of(const std::string& machine) const {
  machines::Channels channels;
  for (const auto& [key, channel] : channels_) {
    if (key.machine == machine) {
      channels.push_back(key.channel);
    }
  }
  return channels;
}

void Core::remove_drained_channels() {
  for (auto it = draining_.begin(); it != draining_.end();) {
    if (channels_.at(*it).is_over()) {
      dispose(context_.answered.take(*it));
      add(past_counts_, channels_.at(*it).status());
      fabric_.dispose(*it);
      access_of(*it).on_over(*it);
      context_.blocked.forget(*it);
      timers_.remove(*it);
      index_.erase(*it);
      context_.predecessor_epochs.erase(*it);
      channels_.erase(*it);
      it = draining_.erase(it);
    } else {
      ++it;
    }
  }
}

void Core::dispose(const std::vector<fabric::RequestKey>& requests) {
  for (const fabric::RequestKey& request : requests) {
    fabric_.dispose(request);
  }
}

bool Core::deliver_queue_events() {
  bool some = false;
  while (const auto event = queues_.next_event()) {
    some = true;
    const fabric::ChannelKey& key = event->key;
    switch (event->kind) {
      using enum MessageQueues::ChannelEvent::Kind;
      case opened:
        link_up(key.machine, {key.channel});
        // Every change there is made by this gateway.
        on_trusted(key, true);
        break;
      case down:
        link_down(key.machine, event->reason);
        break;
      case draining:
        drain(key);
        break;
      case read:
        read_channel(key, event->shown);
        break;
      case written:
        step(key,
             [&](channel::Channel& channel) { channel.on_write(WriteOutcome::written, "", now_); });
        break;
      case changed:
        on_change(key, Variable::request_state);
        break;
    }
    queues_.on_event_delivered(*event);
  }
  return some;
}

}  // namespace millrace::gateway::core
