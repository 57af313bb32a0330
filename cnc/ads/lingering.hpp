// Notifications of connections that are lost, which go on when a client of the same NetId connects
// again: so a TwinCAT router treats them, as reports of clients tell (inferred).
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
  /// Of a client that has some already, only the new ones stay. Those of more than 100 clients are
  /// forgotten (our choice).
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
