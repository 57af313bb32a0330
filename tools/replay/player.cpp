#include "tools/replay/player.hpp"

#include <algorithm>
#include <cassert>

#include <boost/asio/post.hpp>
#include <fmt/format.h>

#include "base/messages/catalogue.hpp"

namespace millrace::tools::replay {

namespace asio = boost::asio;

Player::Player(asio::any_io_executor executor, const Plan& plan, PlayOptions options, Stage& stage)
    : executor_(std::move(executor)),
      timer_(executor_),
      plan_(plan),
      options_(options),
      stage_(stage) {
  assert(!plan.calls.empty());
}

void Player::start() {
  begin_round();
  schedule_step();
}

void Player::begin_round() {
  scheduler_.emplace(plan_, options_.pace);
  ++round_;
  start_ = Clock::now();
}

void Player::schedule_step() {
  asio::post(executor_, [this, alive = std::weak_ptr(alive_)] {
    if (alive.lock()) {
      pump();
    }
  });
}

void Player::pump() {
  if (pumping_ || done_) {
    return;
  }
  pumping_ = true;
  withdraw_overdue(Clock::now());
  while (!stopped_) {
    const Clock::time_point now = Clock::now();
    const auto call = scheduler_->next(now - start_);
    if (!call) {
      break;
    }
    issue(*call, now);
  }
  pumping_ = false;
  const bool round_over = stopped_ ? open_.empty() : scheduler_->done();
  if (round_over && (stopped_ || round_ == options_.rounds)) {
    done_ = true;
    timer_.cancel();
    stage_.on_done();
  } else if (round_over) {
    begin_round();
    schedule_step();
  } else {
    set_timer();
  }
}

void Player::issue(std::size_t call, Clock::time_point now) {
  const PlannedCall& planned = plan_.calls[call];
  const bool timed = options_.pace.timing == Timing::timed;
  const nanoseconds patience =
      planned.withdrawn_after ? options_.pace.scaled(*planned.withdrawn_after) : options_.patience;
  open_.emplace(call, Open{.issued = now,
                           .late = timed ? now - start_ - scheduler_->due(call) : nanoseconds{},
                           .held_up = scheduler_->was_held_up(call),
                           .until = now + patience});
  stage_.issue(call);
}

void Player::ended(std::size_t call, std::optional<Answer> answer, const std::string& reason) {
  const auto found = open_.find(call);
  if (found == open_.end()) {
    return;
  }
  const Open open = found->second;
  open_.erase(found);
  scheduler_->ended(call);
  ++finished_;
  stage_.on_outcome({.call = call,
                     .round = round_,
                     .answer = std::move(answer),
                     .reason = reason,
                     .took = Clock::now() - open.issued,
                     .late = open.late,
                     .held_up = open.held_up});
  schedule_step();
}

void Player::stop(const std::string& reason) {
  stopped_ = true;
  std::vector<std::size_t> calls;
  for (auto& [call, open] : open_) {
    if (!open.withdrawn) {
      open.withdrawn = true;
      calls.push_back(call);
    }
  }
  for (const std::size_t call : calls) {
    stage_.withdraw(call, reason);
  }
  schedule_step();
}

void Player::withdraw_overdue(Clock::time_point now) {
  std::vector<std::size_t> overdue;
  for (auto& [call, open] : open_) {
    if (!open.withdrawn && open.until <= now) {
      open.withdrawn = true;
      overdue.push_back(call);
    }
  }
  for (const std::size_t call : overdue) {
    const auto& withdrawn = plan_.calls[call].withdrawn_after;
    stage_.withdraw(
        call, withdrawn ? base::messages::withdrawn_as_recorded()
                        : base::messages::no_response_in_replay(fmt::format(
                              "{:g}", std::chrono::duration<double>(options_.patience).count())));
  }
}

std::optional<std::size_t> Player::upcoming() const {
  if (options_.pace.timing != Timing::step || done_ || stopped_ || !open_.empty() ||
      scheduler_->issued() == plan_.calls.size()) {
    return std::nullopt;
  }
  return scheduler_->issued();
}

void Player::allow() {
  scheduler_->allow();
  schedule_step();
}

void Player::set_timer() {
  std::optional<Clock::time_point> next;
  const auto consider = [&](Clock::time_point time) { next = next ? std::min(*next, time) : time; };
  if (const auto due = scheduler_->next_time(); due && !stopped_) {
    consider(start_ + *due);
  }
  for (const auto& [call, open] : open_) {
    if (!open.withdrawn) {
      consider(open.until);
    }
  }
  if (!next) {
    timer_.cancel();
    return;
  }
  timer_.expires_at(*next);
  timer_.async_wait([this, alive = std::weak_ptr(alive_)](const boost::system::error_code& error) {
    if (!error && alive.lock()) {
      pump();
    }
  });
}

}  // namespace millrace::tools::replay
