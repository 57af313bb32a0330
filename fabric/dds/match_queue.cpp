#include "fabric/dds/match_queue.hpp"

#include "base/program/barrier.hpp"

namespace millrace::fabric::dds {

void MatchQueue::listen(dds_listener_t* listener) {
  dds_lset_publication_matched_arg(
      listener,
      [](dds_entity_t, dds_publication_matched_status_t status, void* self) noexcept {
        static_cast<MatchQueue*>(self)->put(status.last_subscription_handle,
                                            status.current_count_change);
      },
      this, true);
  dds_lset_subscription_matched_arg(
      listener,
      [](dds_entity_t, dds_subscription_matched_status_t status, void* self) noexcept {
        static_cast<MatchQueue*>(self)->put(status.last_publication_handle,
                                            status.current_count_change);
      },
      this, true);
}

void MatchQueue::put(dds_instance_handle_t handle, std::int32_t change) noexcept {
  base::program::contain("processing matched endpoints", [&] {
    if (change != 0) {
      const std::lock_guard guard(lock_);
      matches_.emplace_back(handle, change > 0);
    }
    changed_();
  });
}

std::vector<MatchQueue::Match> MatchQueue::take() {
  const std::lock_guard guard(lock_);
  return std::exchange(matches_, {});
}

}  // namespace millrace::fabric::dds
