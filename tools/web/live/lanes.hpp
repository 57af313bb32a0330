// Threads beside the loop, one for each lane, for what would hold it up.
//
//   Lanes lanes(io.get_executor());
//   if (!lanes.run(std::move(later), [](http::Response response) { … }))   // on the loop
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

class Lanes {
 public:
  using Done = std::function<void(http::Response)>;
  /// So much waits in a lane; who comes then is told to come again.
  static constexpr std::size_t most_waiting = 16;

  explicit Lanes(boost::asio::any_io_executor loop) : loop_(std::move(loop)) {}
  ~Lanes() { stop(); }
  Lanes(const Lanes&) = delete;
  Lanes& operator=(const Lanes&) = delete;

  /// Waits for what is being done; what has not been begun is dropped. Nothing runs afterwards.
  void stop();

  /// False, and nothing happens, if the lane is full. What the work throws becomes an answer.
  bool run(http::Later later, Done done);

 private:
  struct LaneThread {
    boost::asio::thread_pool thread{1};
    std::size_t waiting = 0;
  };

  boost::asio::any_io_executor loop_;
  std::array<LaneThread, 3> lanes_;
};

}  // namespace millrace::tools::web::live
