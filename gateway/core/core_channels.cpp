// The set of channels. Those of a controller begin with its link and end when the configuration no
// longer names them or another gateway serves them. Those of message queues begin and end with
// their queues.
#include <utility>

#include "base/messages/catalogue.hpp"
#include "fabric/channel_scope.hpp"
#include "gateway/core/core.hpp"

namespace millrace::gateway::core {

ServiceAccess& Core::access_of(const fabric::ChannelKey& key) {
  return fabric::queue_of(key.machine).empty() ? static_cast<ServiceAccess&>(machines_) : queues_;
}

void Core::serve(const std::string& machine, const machines::Channels& channels) {
  for (const std::uint16_t number : channels) {
    reserve_numbers();
    channel::Channel& channel = open({machine, number});
    if (channel.draining()) {
      channels_.stay(channel.key());
      channel.resume_ownership(now_);
      follow(channel);
    }
    if (!channel.linked()) {
      channel.on_link_up(now_);
      follow(channel);
    }
  }
  for (const fabric::ChannelKey& key : channels_.leaving()) {
    channel::Channel& channel = *channels_.find(key);
    if (key.machine == machine && !channel.linked()) {
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

void Core::take_down(const std::string& machine, const fabric::Message& reason) {
  lose_link(machine, [&](channel::Channel& channel) { channel.on_link_down(reason, now_); });
}

void Core::on_serve(const std::string& machine, const machines::Channels& channels) {
  queues_.on_up(machine, channels, *machines_.link_of(machine), now_);
  serve(machine, channels);
}

void Core::on_lost(const std::string& machine, const fabric::Message& reason) {
  take_down(machine, reason);
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
  if (channel::Channel* channel = channels_.find(key)) {
    channels_.leave(key);
    channel->drain(now_);
    follow(*channel);
  }
  remove_drained_channels();
}

void Core::on_not_owner(const fabric::ChannelKey& key, const fabric::Message& reason) {
  if (channel::Channel* channel = channels_.find(key)) {
    channels_.leave(key);
    if (channel->may_be_assigned()) {
      // The other may never take it up before we serve the channel again.
      const auto call = channel->call();
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
  if (call.call.epoch != admission_.numbers.epoch()) {
    context_.predecessor_epochs[key] = call.call.epoch;
  }
  admission_.predecessors.add(key, std::move(call));
}

void Core::remove_drained_channels() {
  while (const auto key = channels_.next_over()) {
    dispose(context_.answered.take(*key));
    context_.fabric.dispose(*key);
    access_of(*key).on_over(*key);
    context_.blocked.forget(*key);
    context_.predecessor_epochs.erase(*key);
    channels_.remove(*key);
  }
}

void Core::dispose(const std::vector<fabric::RequestKey>& requests) {
  for (const fabric::RequestKey& request : requests) {
    context_.fabric.dispose(request);
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
        serve(key.machine, {key.channel});
        // Every change there is made by this gateway.
        on_trusted(key, true);
        break;
      case down:
        take_down(key.machine, event->reason);
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
