#include "tools/web/live/workers.hpp"

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

void Workers::stop() {
  for (Worker& worker : workers_) {
    worker.thread.stop();
  }
  for (Worker& worker : workers_) {
    worker.thread.join();
  }
}

bool Workers::run(http::Later later, Done done) {
  Worker& worker = workers_.at(static_cast<std::size_t>(later.worker));
  if (worker.waiting >= most_waiting) {
    return false;
  }
  ++worker.waiting;
  boost::asio::post(worker.thread,
                    [this, &worker, later = std::move(later), done = std::move(done)] {
                      boost::asio::post(loop_, [&worker, done, finished = finish(later)] {
                        --worker.waiting;
                        done(finished());
                      });
                    });
  return true;
}

}  // namespace millrace::tools::web::live
