#include "tools/web/live/lanes.hpp"

#include <exception>

#include <boost/asio/post.hpp>
#include <fmt/format.h>

namespace millrace::tools::web::live {

namespace {

std::function<http::Response()> finish(const http::Later& later) noexcept {
  try {
    return later.work();
  } catch (const std::exception& error) {
    return [what = std::string(error.what())] {
      return http::error_response(503, fmt::format("failed: {}", what));
    };
  }
}

}  // namespace

void Lanes::stop() {
  for (LaneThread& lane : lanes_) {
    lane.thread.stop();
  }
  for (LaneThread& lane : lanes_) {
    lane.thread.join();
  }
}

bool Lanes::run(http::Later later, Done done) {
  LaneThread& lane = lanes_.at(static_cast<std::size_t>(later.lane));
  if (lane.waiting >= most_waiting) {
    return false;
  }
  ++lane.waiting;
  boost::asio::post(lane.thread, [this, &lane, later = std::move(later), done = std::move(done)] {
    boost::asio::post(loop_, [&lane, done, finished = finish(later)] {
      --lane.waiting;
      done(finished());
    });
  });
  return true;
}

}  // namespace millrace::tools::web::live
