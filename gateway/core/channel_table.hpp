// The channels of a core, of controllers and of message queues: which there are, which of them are
// leaving, and when each must be read again. Pure.
//
//   ChannelTable channels;
//   channels.set(machines);                              // again when the configuration changes
//   channels.wake_at(channels.open({"cnc", 1}, access, context), at);
//   for (channel::Channel* due : channels.take_due(now.steady)) …      // at channels.next_time()
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fabric/request_key.hpp"
#include "gateway/channel/channel.hpp"
#include "gateway/machines/controller.hpp"
#include "gateway/settings/settings.hpp"

namespace millrace::gateway::core {

/// The calls of all channels since the start, by their end.
struct CallCounts {
  std::uint64_t answered = 0;
  /// Answered with an error by the gateway.
  std::uint64_t failed = 0;
  std::uint64_t withdrawn = 0;
};

class ChannelTable {
 public:
  /// How often the channels of these machines are read from now on.
  void set(const std::vector<settings::MachineSettings>& machines);

  /// The channel of this key, made if there is none; its address stays until it is removed.
  channel::Channel& open(const fabric::ChannelKey& key, ServiceAccess& access,
                         channel::ChannelContext& context);
  void remove(const fabric::ChannelKey& key);
  [[nodiscard]] channel::Channel* find(const fabric::ChannelKey& key) const;
  auto begin() { return channels_.begin(); }
  auto end() { return channels_.end(); }
  [[nodiscard]] machines::Channels of(const std::string& machine) const;
  /// Also those of removed channels.
  [[nodiscard]] CallCounts counts() const;
  /// An answer is on its way into a channel.
  [[nodiscard]] bool answering() const;

  /// The channel is drained or handed over: until it is over, or stays after all.
  void leave(const fabric::ChannelKey& key) { leaving_.insert(key); }
  void stay(const fabric::ChannelKey& key) { leaving_.erase(key); }
  [[nodiscard]] const std::set<fabric::ChannelKey>& leaving() const { return leaving_; }
  /// One that leaves and is over: remove() it.
  [[nodiscard]] std::optional<fabric::ChannelKey> next_over() const;

  /// The channel is due at this time or before. A later time than the one it has changes nothing:
  /// a call moves its channel's next read several times, and to sort the channel again each time
  /// costs more than an early time now and then.
  void wake_at(const fabric::ChannelKey& key, SteadyTime at);
  [[nodiscard]] std::optional<SteadyTime> next_time() const;
  /// Those that are due, in the order of their times; they have no time any more.
  [[nodiscard]] std::vector<channel::Channel*> take_due(SteadyTime now);

 private:
  struct Place {
    channel::Channel* channel = nullptr;
    std::optional<SteadyTime> due{};
  };
  /// In the index, whose keys stay where they are.
  using Due = std::pair<SteadyTime, const fabric::ChannelKey*>;
  /// Of channels that are due together the order is always the same.
  struct Before {
    bool operator()(const Due& a, const Due& b) const {
      return std::tie(a.first, *a.second) < std::tie(b.first, *b.second);
    }
  };

  std::map<std::string, ControllerReads> controllers_;
  std::map<fabric::ChannelKey, channel::Channel> channels_;
  /// The same, to find a channel quickly.
  std::unordered_map<fabric::ChannelKey, Place, fabric::ChannelKeyHash> index_;
  std::set<Due, Before> order_;
  std::set<fabric::ChannelKey> leaving_;
  CallCounts past_counts_;
};

}  // namespace millrace::gateway::core
