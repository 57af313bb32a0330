#include "cnc/ads/connection.hpp"

#include <algorithm>
#include <array>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <fmt/format.h>

#include "base/loop/loop.hpp"
#include "base/program/barrier.hpp"

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using base::loop::quietly;
using Clock = std::chrono::steady_clock;

Moment now() {
  using HundredNanoseconds = std::chrono::duration<std::int64_t, std::ratio<1, 10'000'000>>;
  constexpr std::int64_t unix_epoch = 116'444'736'000'000'000;  // in 100 ns since 1601
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  const auto count = std::chrono::duration_cast<HundredNanoseconds>(since_1970).count();
  return {Clock::now(), static_cast<std::uint64_t>(unix_epoch + count)};
}

// Returns an unspecified endpoint if the peer has already closed; the first read reports that.
tcp::endpoint endpoint_of(const tcp::socket& socket) {
  boost::system::error_code ignored;
  return socket.remote_endpoint(ignored);
}

}  // namespace

Connection::Connection(Transport transport, Device& device, const ServerOptions& options,
                       const SessionOptions& session, Lingering* lingering, base::program::Log log)
    : transport_(std::move(transport)),
      executor_(transport_.stream->socket().get_executor()),
      options_(options),
      session_(device, session, lingering),
      reader_(options.max_frame, transport_.framing),
      outbox_(transport_, options.max_output),
      due_(executor_, Clock::time_point::max()),
      idle_(executor_),
      last_received_(Clock::now()),
      log_(std::move(log)) {
  const auto endpoint = endpoint_of(transport_.stream->socket());
  address_ = endpoint.address();
  peer_ = fmt::format("{}:{}", address_.to_string(), endpoint.port());
}

asio::awaitable<void> Connection::run() {
  const auto self = shared_from_this();
  asio::co_spawn(executor_, write(self), base::program::rethrow_from_loop);
  asio::co_spawn(executor_, send_when_due(self), base::program::rethrow_from_loop);
  if (options_.idle_time.count() > 0) {
    asio::co_spawn(executor_, close_when_idle(self), base::program::rethrow_from_loop);
  }
  co_await receive();
  close();
  session_.end();
}

asio::awaitable<void> Connection::write(std::shared_ptr<Connection> self) {
  co_await self->outbox_.run();
  self->close();
}

asio::awaitable<void> Connection::send_when_due(std::shared_ptr<Connection> self) {
  while (!self->outbox_.stopped()) {
    self->due_.expires_at(self->next_due());
    co_await self->due_.async_wait(quietly);
    co_await self->outbox_.room();
    if (self->outbox_.stopped()) {
      co_return;  // the server, its device and its options may be destroyed
    }
    const auto time = now();
    if (!self->line_is_full()) {
      self->send(self->session_.poll(time), time);
    }
    self->outbox_.push(self->faulty_line_.take(time.steady));
  }
}

asio::awaitable<void> Connection::close_when_idle(std::shared_ptr<Connection> self) {
  const auto limit = self->options_.idle_time;
  auto since = self->last_moved();
  while (true) {
    self->idle_.expires_at(since + limit);
    co_await self->idle_.async_wait(quietly);
    if (self->closed()) {
      co_return;
    }
    const auto moved = self->last_moved();
    if (moved > since) {
      since = moved;
    } else if (self->peer_waits()) {
      since = Clock::now();
    } else {
      self->log_->info(
          "{}: connection closed by us: {} for {} s", self->peer_,
          self->outbox_.size() > 0 ? "the peer did not read what was sent" : "it was not used",
          std::chrono::duration<double>(limit).count());
      self->close();
    }
  }
}

asio::awaitable<void> Connection::drained(std::shared_ptr<Connection> self) {
  asio::steady_timer delayed(self->executor_);
  while (!self->outbox_.stopped()) {
    co_await self->outbox_.drained();
    const auto due = self->faulty_line_.next_due();
    if (!due) {
      co_return;
    }
    delayed.expires_at(*due);
    co_await delayed.async_wait(quietly);
  }
}

asio::awaitable<void> Connection::receive() {
  std::array<std::uint8_t, chunk_size> chunk{};
  while (!outbox_.stopped()) {
    const auto buffer = asio::buffer(chunk);
    const auto [error, size] = co_await transport_.stream->read_some(buffer);
    if (error) {
      log_->debug("{}: connection closed: {}", peer_, error.message());
      co_return;
    }
    last_received_ = Clock::now();
    reader_.feed(BytesView(chunk).first(size));
    co_await react_to_frames();
    if (session_.over()) {
      log_->debug("{}: connection closed: its AMS port was unregistered", peer_);
      co_return;
    }
  }
}

asio::awaitable<void> Connection::react_to_frames() {
  while (!outbox_.stopped()) {
    const auto frame = reader_.next();
    if (frame && !*frame) {
      co_return;
    }
    const auto time = now();
    auto reaction = frame.and_then(
        [&](const std::optional<Frame>& whole) { return session_.react(*whole, time); });
    if (!reaction) {
      log_->warn("{}: connection closed by us: {}", peer_, reaction.error().message);
      close();
      co_return;
    }
    send(std::move(*reaction), time);
    while (session_.working() && !outbox_.stopped()) {
      co_await asio::post(executor_, asio::use_awaitable);
      if (outbox_.stopped()) {
        co_return;  // the device may be destroyed
      }
      auto answer = session_.go_on();
      send(std::move(answer), now());
    }
    if (next_due() < due_.expiry()) {
      due_.cancel();
    }
    if (session_.over()) {
      co_await outbox_.drained();
      co_return;
    }
    co_await room();
  }
}

asio::awaitable<void> Connection::room() {
  co_await outbox_.room();
  asio::steady_timer delayed(executor_);
  while (line_is_full() && !outbox_.stopped()) {
    delayed.expires_at(*faulty_line_.next_due());
    co_await delayed.async_wait(quietly);
  }
}

bool Connection::line_is_full() const {
  return faulty_line_.size() > options_.max_output;
}

void Connection::send(Bytes frames, Moment time) {
  if (frames.empty()) {
    return;
  }
  const auto& faults = options_.faults;
  const bool as_they_are = faults.delay.count() == 0 && faults.drop_every == 0;
  outbox_.set_segment(faults.segment == 0 ? frames.max_size() : faults.segment);
  if (as_they_are) {
    outbox_.push(frames);
  } else {
    faulty_line_.push(std::move(frames), faults, time.steady);
  }
}

Subscriptions::Time Connection::next_due() const {
  const auto notification = line_is_full() ? Clock::time_point::max()
                                           : session_.next_due().value_or(Clock::time_point::max());
  const auto answer = faulty_line_.next_due().value_or(Clock::time_point::max());
  return std::min(notification, answer);
}

Subscriptions::Time Connection::last_moved() const {
  return std::max(last_received_, outbox_.last_taken());
}

bool Connection::peer_waits() const {
  return outbox_.size() == 0 && next_due() != Clock::time_point::max();
}

void Connection::close() {
  outbox_.stop();
  due_.cancel();
  idle_.cancel();
  boost::system::error_code ignored;
  transport_.stream->socket().close(ignored);
}

}  // namespace millrace::cnc::ads
