#include "gateway/core/channel_table.hpp"

#include <algorithm>

namespace millrace::gateway::core {

namespace {

void add(CallCounts& counts, const fabric::ChannelStatus& status) {
  counts.answered += status.answered;
  counts.failed += status.failed;
  counts.withdrawn += status.withdrawn;
}

}  // namespace

void ChannelTable::set(const std::vector<settings::MachineSettings>& machines) {
  for (auto& [machine, controller] : controllers_) {
    controller.intervals = {};
  }
  for (const settings::MachineSettings& machine : machines) {
    controllers_[machine.name].intervals = machine.intervals;
  }
}

channel::Channel& ChannelTable::open(const fabric::ChannelKey& key, ServiceAccess& access,
                                     channel::ChannelContext& context) {
  channel::Channel& channel =
      channels_.try_emplace(key, key, access, context, controllers_[key.machine]).first->second;
  index_[key].channel = &channel;
  return channel;
}

void ChannelTable::remove(const fabric::ChannelKey& key) {
  const auto place = index_.find(key);
  add(past_counts_, place->second.channel->status());
  if (place->second.due) {
    order_.erase({*place->second.due, &place->first});
  }
  index_.erase(place);
  leaving_.erase(key);
  channels_.erase(key);
}

channel::Channel* ChannelTable::find(const fabric::ChannelKey& key) const {
  const auto found = index_.find(key);
  return found == index_.end() ? nullptr : found->second.channel;
}

machines::Channels ChannelTable::of(const std::string& machine) const {
  machines::Channels channels;
  for (const auto& [key, channel] : channels_) {
    if (key.machine == machine) {
      channels.push_back(key.channel);
    }
  }
  return channels;
}

CallCounts ChannelTable::counts() const {
  CallCounts counts = past_counts_;
  for (const auto& [key, channel] : channels_) {
    add(counts, channel.status());
  }
  return counts;
}

bool ChannelTable::answering() const {
  return std::ranges::any_of(channels_, [](const auto& channel) {
    return channel.second.status().state == fabric::ChannelState::answering;
  });
}

std::optional<fabric::ChannelKey> ChannelTable::next_over() const {
  const auto over =
      std::ranges::find_if(leaving_, [&](const auto& key) { return find(key)->is_over(); });
  return over == leaving_.end() ? std::nullopt : std::optional(*over);
}

void ChannelTable::wake_at(const fabric::ChannelKey& key, SteadyTime at) {
  const auto place = index_.find(key);
  std::optional<SteadyTime>& due = place->second.due;
  if (due && *due <= at) {
    return;
  }
  if (due) {
    order_.erase({*due, &place->first});
  }
  due = at;
  order_.emplace(at, &place->first);
}

std::optional<SteadyTime> ChannelTable::next_time() const {
  return order_.empty() ? std::nullopt : std::optional(order_.begin()->first);
}

std::vector<channel::Channel*> ChannelTable::take_due(SteadyTime now) {
  std::vector<channel::Channel*> due;
  while (!order_.empty() && order_.begin()->first <= now) {
    Place& place = index_.at(*order_.begin()->second);
    order_.erase(order_.begin());
    place.due.reset();
    due.push_back(place.channel);
  }
  return due;
}

}  // namespace millrace::gateway::core
