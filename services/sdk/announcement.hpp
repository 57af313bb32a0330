// What the services of a configuration file announce: one struct for batch, HTTP and LCM.
//
//   script.announcement = announced(from, config::Batch::AT_LEAST_ONCE, path, mistakes);
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/configuration/mistakes.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/messages.hpp"

namespace millrace::services::sdk {

/// The properties that tools and gateways see; a change needs a new registration.
struct Announcement {
  /// Canonical (fabric::canonical_uuid).
  std::string uuid{};
  std::string name{};
  std::string description{};
  /// Empty = that of the process.
  std::string version{};
  /// Empty = any.
  std::vector<fabric::ChannelScope> channels{};
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  std::uint32_t concurrency = 1;
  bool operator==(const Announcement&) const = default;
};

/// The field "channel" of the service at `path`.
template <typename From>
std::vector<fabric::ChannelScope> channels_of(const From& from,
                                              const base::configuration::ConfigPath& path,
                                              base::configuration::Mistakes& mistakes) {
  std::vector<fabric::ChannelScope> channels;
  for (int i = 0; i < from.channel_size(); ++i) {
    channels.push_back(mistakes.take(fabric::parse_channel_scope(from.channel(i)),
                                     path / base::configuration::ConfigStep{"channel", i}));
  }
  return channels;
}

/// The service at `path` of a configuration.
template <typename From, typename Delivery>
Announcement announced(const From& from, Delivery at_least_once,
                       const base::configuration::ConfigPath& path,
                       base::configuration::Mistakes& mistakes) {
  return {.uuid = fabric::canonical_uuid(from.uuid()),
          .name = from.name(),
          .description = from.description(),
          .channels = channels_of(from, path, mistakes),
          .delivery = from.delivery() == at_least_once ? fabric::Delivery::at_least_once
                                                       : fabric::Delivery::at_most_once,
          .concurrency = from.concurrency()};
}

}  // namespace millrace::services::sdk
