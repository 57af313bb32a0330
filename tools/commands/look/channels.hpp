// The rows and columns of `millrace channels`. Pure.
#pragma once

#include <string>
#include <vector>

#include "fabric/plant/channel_view.hpp"
#include "tools/print/listing.hpp"

namespace millrace::tools::commands::look {

struct ChannelRow {
  fabric::ChannelStatus status{};
  fabric::plant::ChannelView view{};
  /// Of the service, while an instance is known.
  std::string service{};
};

/// Problems first.
std::vector<ChannelRow> channel_rows(const fabric::plant::Plant& live, fabric::Time now);
const print::Listing<ChannelRow>& channels_listing();

}  // namespace millrace::tools::commands::look
