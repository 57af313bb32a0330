#include "tests/simulation/time/agenda.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace millrace::tests::simulation {

namespace {

bool later(const Happening& a, const Happening& b) {
  return std::tie(a.at, a.number) > std::tie(b.at, b.number);
}

}  // namespace

void Agenda::at(Time when, const Plan& plan, std::function<void()> act) {
  Happening one;
  one.at = std::max(when, now_);
  one.number = ++planned_;
  one.parties = plan.parties;
  one.reads = plan.reads;
  one.timer = plan.timer;
  one.lane = plan.lane;
  one.lives = plan.lives;
  one.lives.first_planned_in = plan.lives.first != nullptr ? *plan.lives.first : 0;
  one.lives.second_planned_in = plan.lives.second != nullptr ? *plan.lives.second : 0;
  one.act = std::move(act);
  waiting_.push_back(std::move(one));
  if (order_ != nullptr) {
    order_->planned(waiting_.back(), plan.means);
  } else {
    std::ranges::push_heap(waiting_, later);
  }
}

bool Agenda::step() {
  if (waiting_.empty()) {
    return false;
  }
  if (order_ == nullptr) {
    std::ranges::pop_heap(waiting_, later);
  } else {
    // Who tries all orders need not try when nothing happens.
    std::erase_if(waiting_, [](const Happening& one) { return one.lives.over(); });
    const auto chosen = order_->choose(waiting_, now_);
    if (!chosen) {
      return false;
    }
    std::swap(waiting_[*chosen], waiting_.back());
  }
  Happening next = std::move(waiting_.back());
  waiting_.pop_back();
  now_ = std::max(now_, next.at);
  if (order_ != nullptr) {
    // What is first and what second is seen by the time.
    now_ += 1ns;
    order_->happens(next);
  }
  next.act();
  if (order_ != nullptr) {
    order_->happened();
  }
  return true;
}

}  // namespace millrace::tests::simulation
