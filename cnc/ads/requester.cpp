#include "cnc/ads/requester.hpp"

#include <algorithm>
#include <cassert>
#include <optional>
#include <random>
#include <utility>

#include <boost/asio/steady_timer.hpp>

#include "base/loop/loop.hpp"

namespace millrace::cnc::ads {
namespace {

namespace asio = boost::asio;
using base::loop::quietly;

/// Enough to receive what has arrived.
constexpr std::chrono::milliseconds receive_first{100};

}  // namespace

// A coroutine that waits for the response to a request. The timer expires at its deadline; the
// response cancels it.
struct Requester::Waiter {
  asio::steady_timer timer;
  std::optional<Result<Bytes>> answer;
  std::chrono::steady_clock::time_point asked;

  void wake(Result<Bytes> with) {
    answer = std::move(with);
    timer.cancel();
  }
};

// The table entry of a waiter while its coroutine is in the request, also if the coroutine is
// destroyed while it waits.
class Requester::Place {
 public:
  Place(Requester& requester, Exchange::Id id, Waiter& waiter) : requester_(requester), id_(id) {
    requester_.waiters_.emplace(id, &waiter);
  }
  ~Place() {
    if (requester_.waiters_.erase(id_) > 0) {
      requester_.exchange_.give_up(id_);
      requester_.flush();
    }
  }
  Place(const Place&) = delete;
  Place& operator=(const Place&) = delete;

 private:
  Requester& requester_;
  Exchange::Id id_;
};

Requester::Requester(asio::any_io_executor executor, const ClientOptions& options)
    : executor_(std::move(executor)),
      timeout_(options.timeout),
      signs_(options.probe_port, options.timeout),
      silence_check_(executor_),
      max_frame_(options.max_frame),
      exchange_(options.source, options.target, options.in_flight, std::random_device{}()) {}

asio::awaitable<Result<Bytes>> Requester::request(std::shared_ptr<Requester> self,
                                                  std::uint16_t port, Command command,
                                                  Bytes payload) {
  if (!self->link_) {
    co_return tl::make_unexpected(ErrorCode::link_down);
  }
  Waiter waiter{asio::steady_timer(self->executor_, self->timeout_), std::nullopt,
                std::chrono::steady_clock::now()};
  const std::uint64_t answers_before = self->exchange_.answers();
  const auto id = self->exchange_.begin(port, command, payload);
  const Place place(*self, id, waiter);
  self->flush();
  const auto [interrupted] = co_await waiter.timer.async_wait(quietly);
  if (waiter.answer) {
    co_return std::move(*waiter.answer);
  }
  if (interrupted) {
    co_return tl::make_unexpected(ErrorCode::cancelled);
  }
  self->time_out(id, answers_before);
  co_return tl::make_unexpected(ErrorCode::timeout);
}

void Requester::open(Transport transport) {
  assert(!link_);
  // Later than our own examination, which knows the reason.
  link_ = std::make_shared<Link>(std::move(transport), max_frame_, 2 * timeout_, handlers());
  signs_.begin(std::chrono::steady_clock::now());
  link_->start();
}

void Requester::disconnect() {
  silence_check_.cancel();
  examined_ = false;
  if (const auto link = std::exchange(link_, nullptr)) {
    link->close();
  }
  for (const auto id : exchange_.lose_link()) {
    const auto waiter = waiters_.extract(id);
    assert(!waiter.empty());
    waiter.mapped()->wake(tl::make_unexpected(ErrorCode::link_lost));
  }
}

void Requester::disconnect(const std::vector<LastRequest>& farewells) {
  if (link_) {
    flush();
    for (const LastRequest& farewell : farewells) {
      exchange_.send(farewell.port, farewell.command, farewell.payload);
    }
    link_->send_last(exchange_.take_output());
  }
  disconnect();
}

LinkHandlers Requester::handlers() {
  const auto weak = weak_from_this();
  return {
      .packet =
          [weak](const Packet& packet) {
            if (const auto self = weak.lock()) {
              self->receive(packet);
            }
          },
      .router_frame =
          [weak] {
            if (const auto self = weak.lock()) {
              self->exchange_.receive_router_frame();
            }
          },
      .ended =
          [weak](const LinkEnd& how) {
            if (const auto self = weak.lock()) {
              self->end(how);
            }
          },
  };
}

void Requester::receive(const Packet& packet) {
  if (exchange_.notifies(packet)) {
    on_notification(packet);
    return;
  }
  const std::uint64_t answers_before = exchange_.answers();
  auto completion = exchange_.receive(packet);
  const auto now = std::chrono::steady_clock::now();
  if (exchange_.answers() != answers_before) {
    signs_.answered(packet.header.source.port, completion.has_value(), now);
  } else if (completion) {
    signs_.not_delivered(completion->port, completion->response.error(), now);
  }
  if (completion) {
    const auto waiter = waiters_.extract(completion->id);
    assert(!waiter.empty());
    exchange_.answered_after(now - waiter.mapped()->asked);
    waiter.mapped()->wake(std::move(completion->response));
  }
  flush();
  end_if_refused();
}

void Requester::flush() {
  const auto frames = exchange_.take_output();
  if (link_ && !frames.empty()) {
    link_->send(frames);
  }
}

void Requester::end(const LinkEnd& how) {
  disconnect();
  on_end(how);
}

void Requester::time_out(Exchange::Id id, std::uint64_t answers_before) {
  waiters_.erase(id);
  exchange_.time_out(id);
  flush();
  answers_before_ = std::max(answers_before_, answers_before);
  if (!link_ || examined_) {
    return;
  }
  // This process may have stood still: first it receives what has arrived.
  examined_ = true;
  silence_check_.expires_after(receive_first);
  silence_check_.async_wait([weak = weak_from_this()](const boost::system::error_code& cancelled) {
    const auto self = weak.lock();
    if (self && !cancelled) {
      self->end_if_silent();
    }
  });
}

void Requester::end_if_silent() {
  examined_ = false;
  const auto now = std::chrono::steady_clock::now();
  const auto silent_for = signs_.silent_for(now);
  const auto late_for = signs_.late_for(now);
  if (exchange_.answers() == answers_before_) {
    end({.cause = LinkEnd::Cause::silent, .silent_for = silent_for});
  } else if (late_for >= 3 * timeout_) {
    end({.cause = LinkEnd::Cause::silent, .silent_for = late_for, .late = timeout_});
  }
}

void Requester::end_if_refused() {
  const auto now = std::chrono::steady_clock::now();
  if (const auto refused = link_ ? signs_.refused(now) : std::nullopt) {
    end({.cause = LinkEnd::Cause::undelivered,
         .silent_for = now - refused->since,
         .error = refused->error});
  }
}

}  // namespace millrace::cnc::ads
