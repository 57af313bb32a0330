#include "cnc/ads/outbox.hpp"

#include <utility>

#include "base/loop/loop.hpp"

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
using base::loop::quietly;
using boost::system::error_code;

}  // namespace

// A timer that never expires serves as condition variable: cancel_one() wakes the coroutine that
// waits for it.
Outbox::Outbox(Transport& transport, std::size_t capacity)
    : transport_(transport),
      capacity_(capacity),
      pushed_(transport.stream->socket().get_executor(), asio::steady_timer::time_point::max()),
      written_(transport.stream->socket().get_executor(), asio::steady_timer::time_point::max()) {}

void Outbox::push(BytesView frames) {
  if (stopped_) {
    return;
  }
  append_frames(waiting_, frames, transport_.framing);
  pushed_.cancel_one();
}

asio::awaitable<error_code> Outbox::run() {
  while (!stopped_) {
    if (waiting_.empty()) {
      co_await pushed_.async_wait(quietly);
      continue;
    }
    std::swap(waiting_, writing_);
    const auto error = co_await write();
    writing_.clear();
    if (error) {
      stop();
      co_return error;
    }
    written_.cancel();
  }
  co_return error_code{};
}

asio::awaitable<error_code> Outbox::write() {
  auto rest = asio::buffer(std::as_const(writing_));
  while (rest.size() > 0) {
    const auto segment = asio::buffer(rest, segment_);
    const auto [error, size] = co_await transport_.stream->write_some(segment);
    if (error) {
      co_return error;
    }
    last_taken_ = std::chrono::steady_clock::now();
    rest += size;
  }
  co_return error_code{};
}

asio::awaitable<void> Outbox::room() {
  while (size() > capacity_ && !stopped_) {
    co_await written_.async_wait(quietly);
  }
}

asio::awaitable<void> Outbox::drained() {
  while (size() > 0 && !stopped_) {
    co_await written_.async_wait(quietly);
  }
}

void Outbox::stop() {
  stopped_ = true;
  pushed_.cancel();
  written_.cancel();
}

}  // namespace millrace::cnc::ads
