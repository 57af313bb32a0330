// Notifications of lost connections, which continue when a client of the same NetId connects again.
// A TwinCAT router does so, by reports of clients (inferred).
//
//   lingering.keep(client, subscriptions.give_up());       // the connection is lost
//   if (auto kept = lingering.take(client))                // its first frame on a new connection
//     subscriptions.adopt(std::move(*kept), now);
#pragma once

#include <map>
#include <optional>
#include <utility>

#include "cnc/ads/subscriptions.hpp"

namespace millrace::cnc::ads {

class Lingering {
 public:
  /// Replaces earlier subscriptions of the client. While those of 100 clients are kept, those of a
  /// further client are dropped (our choice).
  void keep(const NetId& client, Subscriptions::Kept kept) {
    if (!kept.subscriptions.empty() && (kept_.size() < most_clients || kept_.contains(client))) {
      kept_.insert_or_assign(client, std::move(kept));
    }
  }
  std::optional<Subscriptions::Kept> take(const NetId& client) {
    auto node = kept_.extract(client);
    return node.empty() ? std::nullopt : std::optional(std::move(node.mapped()));
  }

 private:
  static constexpr std::size_t most_clients = 100;
  std::map<NetId, Subscriptions::Kept> kept_;
};

}  // namespace millrace::cnc::ads
