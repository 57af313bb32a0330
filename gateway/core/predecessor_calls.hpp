// The requests of channels that other gateways had dispatched before they were gone, and this one
// before it left a channel: an at-most-once call is blocked for an operator if it may be one of
// them. Pure.
//
//   predecessors.add(key, {uuid, "gateway …", call});
//   predecessors.on_read_started(key);  predecessors.on_zero_read(key);     // it is over
//   if (const auto call = predecessors.take(key, canonical_uuid)) …         // the request may be it
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "fabric/messages.hpp"

namespace millrace::gateway::core {

struct PredecessorCall {
  std::string uuid;
  /// The gateway that had it, for people.
  fabric::Message from;
  fabric::CallId call{};
  /// The channel has been read since. A read that began before may show the channel as it was
  /// before that request.
  bool read_since = false;
};

class PredecessorCalls {
 public:
  /// A channel has one call at a time; two gateways that lose each other may leave a few more. A
  /// stranger may publish any number, which only blocks the next calls.
  static constexpr std::size_t most_per_channel = 64;

  /// The last one of each UUID counts.
  void add(const fabric::ChannelKey& key, PredecessorCall call);
  /// A read of the channel begins.
  void on_read_started(const fabric::ChannelKey& key);
  /// A read has shown REQUEST_STATE = 0: what was there before it began is over.
  void on_zero_read(const fabric::ChannelKey& key);
  /// The call is answered, so what the program asks next is new.
  void on_answered(const fabric::ChannelKey& key, const fabric::CallId& call);
  /// A request for this UUID is accepted: which call it may be. Others that are over are forgotten.
  std::optional<PredecessorCall> take(const fabric::ChannelKey& key,
                                      const std::string& canonical_uuid);

 private:
  template <typename Over>
  void erase_if(const fabric::ChannelKey& key, Over over);

  /// By canonical UUID.
  std::map<fabric::ChannelKey, std::map<std::string, PredecessorCall>> calls_;
};

}  // namespace millrace::gateway::core
