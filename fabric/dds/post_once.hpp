// From Cyclone's receive thread to our executor: a listener only posts, the work happens elsewhere.
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include <boost/asio/any_io_executor.hpp>

#include "fabric/dds/entity.hpp"

namespace millrace::fabric::dds {

/// A member of `owner`, which must be held by a shared_ptr and delete the entities that listen
/// before this. Work that is already posted when the owner ends does nothing.
class PostOnce {
 public:
  PostOnce(boost::asio::any_io_executor executor, std::weak_ptr<void> owner,
           std::function<void()> work);
  PostOnce(const PostOnce&) = delete;
  PostOnce& operator=(const PostOnce&) = delete;

  /// Runs the work once on the executor; further calls until it starts are merged into this one.
  /// From any thread, never waits. An exception of the work leaves the executor's loop.
  void post() noexcept;

  /// Makes `listener` wake for data. Pass it to an entity when it is created, because Cyclone 0.10
  /// does not report existing samples to a later listener.
  void listen_for_data(dds_listener_t* listener);

 private:
  boost::asio::any_io_executor executor_;
  std::weak_ptr<void> owner_;
  std::function<void()> work_;
  std::atomic<bool> pending_ = false;
};

}  // namespace millrace::fabric::dds
