#include "fabric/dds/post_once.hpp"

#include <boost/asio/post.hpp>

#include "base/program/barrier.hpp"

namespace millrace::fabric::dds {

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
