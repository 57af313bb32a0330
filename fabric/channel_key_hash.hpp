// A hash for tables that are searched several times in each call.
#pragma once

#include <functional>
#include <string>

#include "fabric/messages.hpp"

namespace millrace::fabric {

struct ChannelKeyHash {
  std::size_t operator()(const ChannelKey& key) const {
    constexpr std::size_t spread = 0x9e3779b97f4a7c15;
    return std::hash<std::string>()(key.machine) ^ (spread * (key.channel + std::size_t{1}));
  }
};

}  // namespace millrace::fabric
