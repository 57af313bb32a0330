#include "fabric/dds/listeners.hpp"

#include <boost/asio/post.hpp>

#include "base/program/barrier.hpp"

namespace millrace::fabric::dds {

void SerialListener::run() noexcept {
  if (asked_.fetch_add(1) == 0) {
    take_turns();
  }
}

void SerialListener::take_turns() noexcept {
  unsigned seen = asked_.load();
  do {
    // Also after an exception: the next caller must find the serial free.
    base::program::contain("receiving samples from the fabric", work_);
  } while (!asked_.compare_exchange_strong(seen, 0));
}

void SerialListener::listen_for_data(dds_listener_t* listener) {
  dds_lset_data_available_arg(
      listener,
      [](dds_entity_t, void* self) noexcept { static_cast<SerialListener*>(self)->run(); }, this,
      true);
}

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

PostOnce::PostOnce(boost::asio::any_io_executor executor, std::weak_ptr<void> owner,
                   std::function<void()> work)
    : executor_(std::move(executor)), owner_(std::move(owner)), work_(std::move(work)) {}

void PostOnce::post() noexcept {
  if (pending_.exchange(true)) {
    return;
  }
  bool posted = false;
  base::program::contain("passing on samples from the fabric", [&] {
    boost::asio::post(executor_, [this, owner = owner_] {
      if (const auto alive = owner.lock()) {
        // Cleared first: what arrives during the work wakes again.
        pending_ = false;
        work_();
      }
    });
    posted = true;
  });
  if (!posted) {
    // The next one tries again.
    pending_ = false;
  }
}

void PostOnce::listen_for_data(dds_listener_t* listener) {
  dds_lset_data_available_arg(
      listener, [](dds_entity_t, void* self) noexcept { static_cast<PostOnce*>(self)->post(); },
      this, true);
}

}  // namespace millrace::fabric::dds
