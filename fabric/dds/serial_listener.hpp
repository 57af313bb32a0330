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

}  // namespace millrace::fabric::dds
