// An event loop that stays awake for a moment after a request was published.
//
//   SpinAfterPublish spin;
//   spin.expect();         // an answer may come at once
//   spin.run(io);          // instead of io.run()
//
// To be woken by the thread that receives the reply costs as much as half of the reply's way. A
// fast service replies within the moment, and then the loop is awake already. It yields to every
// thread that needs the core, so a busy host loses nothing.
#pragma once

#include <chrono>
#include <thread>

#include <boost/asio/io_context.hpp>

namespace millrace::gateway::shell {

class SpinAfterPublish {
 public:
  /// Twice what a call to a quick service takes on one host. At 100 calls a second it costs 1 % of
  /// a core.
  static constexpr std::chrono::microseconds moment{100};

  /// On the loop.
  void expect() {
    until_ = std::chrono::steady_clock::now() + moment;
    awake_ = true;
  }

  /// Runs the loop until it is stopped or has nothing left to do, or `done()`.
  template <typename Done>
  void run(boost::asio::io_context& io, Done done) {
    while (!done() && !io.stopped()) {
      if (!awake_) {
        io.run_one();
      } else if (io.poll() == 0) {
        awake_ = std::chrono::steady_clock::now() < until_;
        std::this_thread::yield();
      }
    }
  }

 private:
  std::chrono::steady_clock::time_point until_{};
  bool awake_ = false;
};

}  // namespace millrace::gateway::shell
