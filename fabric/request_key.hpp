// The DDS key of a request: a channel, as one gateway asks one instance for it.
//
// Two gateways may have had the same channel, one after the other or without receiving each other.
// Neither replaces or withdraws the requests of the other; nor does an attempt those of another
// instance. An epoch is not secret, so an instance also distinguishes requesters by the writer that
// DDS names.
#pragma once

#include <compare>
#include <cstdint>
#include <cstring>
#include <functional>
#include <string>
#include <tuple>
#include <variant>

#include "base/recent.hpp"
#include "fabric/messages.hpp"

namespace millrace::fabric {

// A hash for tables that are searched several times in each call.

struct ChannelKeyHash {
  std::size_t operator()(const ChannelKey& key) const {
    constexpr std::size_t spread = 0x9e3779b97f4a7c15;
    return std::hash<std::string>()(key.machine) ^ (spread * (key.channel + std::size_t{1}));
  }
};

struct RequestKey {
  ChannelKey key{};
  /// Of the call: it names the gateway, or the tool that calls in a gateway's place.
  std::uint64_t epoch = 0;
  InstanceId instance{};
  /// In a request that an instance has taken: its requester (Request::requester).
  std::uint64_t requester = 0;
  bool operator==(const RequestKey&) const = default;
  /// By channel; its number first, since channels of one machine share a name.
  auto operator<=>(const RequestKey& other) const {
    return std::tie(key.channel, key.machine, epoch, instance, requester) <=>
           std::tie(other.key.channel, other.key.machine, other.epoch, other.instance,
                    other.requester);
  }
};

struct RequestKeyHash {
  /// Instance ids are random, and in time a channel's calls go to every instance.
  std::size_t operator()(const RequestKey& key) const {
    std::size_t instance = 0;
    std::memcpy(&instance, key.instance.bytes.data(), sizeof instance);
    return ChannelKeyHash()(key.key) ^ key.epoch ^ instance;
  }
};

template <typename Value = std::monostate>
using RecentRequests = base::Recent<RequestKey, Value, RequestKeyHash>;

inline RequestKey key_of(const Request& request) {
  return {request.key, request.call.epoch, request.assigned, request.requester};
}
/// The sample that withdraws a request. The writer disposes the key after it.
inline Request withdrawal_of(const RequestKey& key) {
  return {.key = key.key, .call = {.epoch = key.epoch}, .attempt = 0, .assigned = key.instance};
}
inline bool is_withdrawal(const Request& request) {
  return request.attempt == 0;
}
inline RequestKey key_of(const Reply& reply) {
  return {reply.key, reply.call.epoch, reply.instance};
}

}  // namespace millrace::fabric
