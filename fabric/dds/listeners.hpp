// Work in the thread that brings it: Cyclone's receive threads, one at a time.
//
//   SerialListener serial([this] { drain(); });
//   serial.listen_for_data(listener);    // data that arrives now waits
//   serial.open();                       // runs drain() if any has come, from now on at once
//
// Saves the hand-over to an executor (PostOnce). A receive thread carries discovery, leases and the
// data of the whole process: the work must not wait for anything.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <boost/asio/any_io_executor.hpp>

#include "fabric/dds/entity.hpp"

namespace millrace::fabric::dds {

class SerialListener {
 public:
  explicit SerialListener(std::function<void()> work) : work_(std::move(work)) {}
  SerialListener(const SerialListener&) = delete;
  SerialListener& operator=(const SerialListener&) = delete;

  /// Until then the work does not run, and what it uses may be built. Runs it once.
  void open() noexcept { take_turns(); }

  /// Runs the work in this thread, or makes the thread that is running it run it once more. An
  /// exception of the work is reported here and goes no further.
  void run() noexcept;

  /// Makes `listener` run the work for data; see PostOnce::listen_for_data.
  void listen_for_data(dds_listener_t* listener);

 private:
  void take_turns() noexcept;

  std::function<void()> work_;
  /// Number of requests for the work since it last ended; the constructor makes the first.
  std::atomic<unsigned> asked_ = 1;
};

// Which endpoints were matched with ours and which were unmatched, one by one: to ask Cyclone for
// all of them each time costs as much as there are endpoints.
//
//   MatchQueue matches([this] { post.post(); });
//   matches.listen(listener);               // to be given to readers and writers when created
//   for (const auto& [handle, is] : matches.take()) …

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

// From Cyclone's receive thread to our executor: a listener only posts, the work happens elsewhere.

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
