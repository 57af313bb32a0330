// Threads beside the loop, for each kind of work that would block it.
//
//   Workers workers(io.get_executor());
//   if (!workers.run(std::move(later), [](http::Response response) { … }))   // on the loop
//     … the queue is full
#pragma once

#include <array>
#include <cstddef>
#include <functional>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/thread_pool.hpp>

#include "tools/web/http/message.hpp"

namespace millrace::tools::web::live {

class Workers {
 public:
  using Done = std::function<void(http::Response)>;
  /// Longest queue of a worker; further requests get status 503.
  static constexpr std::size_t most_waiting = 16;
  /// A call waits for its service most of the time.
  static constexpr std::size_t calls_at_once = 8;

  explicit Workers(boost::asio::any_io_executor loop) : loop_(std::move(loop)) {}
  ~Workers() { stop(); }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// Waits for the present work and drops the rest. Nothing runs afterwards.
  void stop();

  /// False, without effect, if the worker's queue is full. An exception of the work becomes a
  /// response.
  bool run(http::Later later, Done done);

 private:
  struct Worker {
    boost::asio::thread_pool thread;
    std::size_t waiting = 0;
  };

  boost::asio::any_io_executor loop_;
  /// By WorkerKind.
  std::array<Worker, 4> workers_{{{1}, {1}, {1}, {calls_at_once}}};
};

}  // namespace millrace::tools::web::live
