// Work in the thread that brings it: Cyclone's receive threads, one at a time.
//
//   Turnstile turnstile([this] { drain(); });
//   turnstile.listen_for_data(listener);    // data that arrives now waits
//   turnstile.open();                       // runs drain() if any has come, from now on at once
//
// Saves the hand-over to an executor (Waker). A receive thread carries discovery, leases and the
// data of the whole process: the work must not wait for anything.
#pragma once

#include <atomic>
#include <functional>

#include "fabric/entity.hpp"

namespace millrace::fabric {

class Turnstile {
 public:
  explicit Turnstile(std::function<void()> work) : work_(std::move(work)) {}
  Turnstile(const Turnstile&) = delete;
  Turnstile& operator=(const Turnstile&) = delete;

  /// Until then nothing runs: what the work uses may be built. Runs it once.
  void open() { take_turns(); }

  /// Runs the work in this thread; or has the thread that runs it just now run it once more.
  void run();

  /// Has `listener` run the work for data; see Waker::listen_for_data.
  void listen_for_data(dds_listener_t* listener);

 private:
  void take_turns();

  std::function<void()> work_;
  /// Who asked for the work since it last came to its end; the builder is the first.
  std::atomic<unsigned> asked_ = 1;
};

}  // namespace millrace::fabric
