#include "tests/simulation/time/agenda.hpp"

#include <algorithm>
#include <utility>

namespace millrace::tests::simulation {

void Agenda::at(Time when, const Plan& plan, std::function<void()> act) {
  NcEvent event;
  event.at = std::max(when, now_);
  event.number = ++planned_;
  event.parties = plan.parties;
  event.reads = plan.reads;
  event.timer = plan.timer;
  event.lane = plan.lane;
  event.lives = plan.lives;
  event.lives.first_planned_in = plan.lives.first != nullptr ? *plan.lives.first : 0;
  event.lives.second_planned_in = plan.lives.second != nullptr ? *plan.lives.second : 0;
  event.act = std::move(act);
  if (order_ != nullptr) {
    waiting_.push_back(std::move(event));
    order_->planned(waiting_.back(), plan.means);
  } else {
    keep(std::move(event));
  }
}

void Agenda::keep(NcEvent happening) {
  Due due{happening.at, happening.number, waiting_.size()};
  if (free_.empty()) {
    waiting_.push_back(std::move(happening));
  } else {
    due.place = free_.back();
    free_.pop_back();
    waiting_[due.place] = std::move(happening);
  }
  due_.push_back(due);
  std::ranges::push_heap(due_, later);
}

std::optional<NcEvent> Agenda::take() {
  if (order_ == nullptr) {
    if (due_.empty()) {
      return std::nullopt;
    }
    std::ranges::pop_heap(due_, later);
    const std::size_t place = due_.back().place;
    due_.pop_back();
    free_.push_back(place);
    return std::move(waiting_[place]);
  }
  // A walk need not try orders in which nothing happens.
  std::erase_if(waiting_, [](const NcEvent& event) { return event.lives.over(); });
  const auto chosen = waiting_.empty() ? std::nullopt : order_->choose(waiting_, now_);
  if (!chosen) {
    return std::nullopt;
  }
  std::swap(waiting_[*chosen], waiting_.back());
  NcEvent next = std::move(waiting_.back());
  waiting_.pop_back();
  return next;
}

bool Agenda::step() {
  auto next = take();
  if (!next) {
    return false;
  }
  now_ = std::max(now_, next->at);
  if (order_ != nullptr) {
    // The order of events shows in their times.
    now_ += 1ns;
    order_->happens(*next);
  }
  next->act();
  if (order_ != nullptr) {
    order_->happened();
  }
  return true;
}

}  // namespace millrace::tests::simulation
