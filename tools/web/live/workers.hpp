// Threads beside the loop, one for each worker, for what would hold it up.
//
//   Workers workers(io.get_executor());
//   if (!workers.run(std::move(later), [](http::Response response) { … }))   // on the loop
//     … too much is waiting
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <memory>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/thread_pool.hpp>

#include "tools/web/http/message.hpp"

namespace millrace::tools::web::live {

class Workers {
 public:
  using Done = std::function<void(http::Response)>;
  /// So much waits in a worker; who comes then is told to come again.
  static constexpr std::size_t most_waiting = 16;

  explicit Workers(boost::asio::any_io_executor loop) : loop_(std::move(loop)) {}
  ~Workers() { stop(); }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// Waits for what is being done; what has not been begun is dropped. Nothing runs afterwards.
  void stop();

  /// False, and nothing happens, if the worker is full. What the work throws becomes an answer.
  bool run(http::Later later, Done done);

 private:
  struct Worker {
    boost::asio::thread_pool thread{1};
    std::size_t waiting = 0;
  };

  boost::asio::any_io_executor loop_;
  std::array<Worker, 3> workers_;
};

}  // namespace millrace::tools::web::live
