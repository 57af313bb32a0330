// Which endpoints were matched with ours and which were unmatched, one by one: to ask Cyclone for
// all of them each time costs as much as there are endpoints.
//
//   MatchQueue matches([this] { post.post(); });
//   matches.listen(listener);               // to be given to readers and writers when created
//   for (const auto& [handle, is] : matches.take()) …
#pragma once

#include <functional>
#include <mutex>
#include <utility>
#include <vector>

#include "fabric/dds/entity.hpp"

namespace millrace::fabric::dds {

/// Must outlive the entities that it listens to.
class MatchQueue {
 public:
  /// The other endpoint, as in the samples of DCPSPublication and DCPSSubscription, and whether it
  /// is matched from now on.
  using Match = std::pair<dds_instance_handle_t, bool>;

  /// `changed` is called in Cyclone's thread.
  explicit MatchQueue(std::function<void()> changed) : changed_(std::move(changed)) {}
  MatchQueue(const MatchQueue&) = delete;
  MatchQueue& operator=(const MatchQueue&) = delete;

  /// Makes `listener` report readers and writers.
  void listen(dds_listener_t* listener);

  /// The changes since the last call, in order.
  std::vector<Match> take();

 private:
  void put(dds_instance_handle_t handle, std::int32_t change) noexcept;

  std::function<void()> changed_;
  std::mutex lock_;
  std::vector<Match> matches_;
};

}  // namespace millrace::fabric::dds
