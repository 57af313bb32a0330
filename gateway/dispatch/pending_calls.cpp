#include "gateway/dispatch/pending_calls.hpp"

#include <algorithm>
#include <utility>

namespace millrace::gateway::dispatch {

PendingCall& PendingCalls::enter(PendingCall pending) {
  pending.number = ++entered_;
  const fabric::CallId call = pending.id();
  return calls_.insert_or_assign(call, std::move(pending)).first->second;
}

PendingCall* PendingCalls::find(const fabric::CallId& call) {
  const auto found = calls_.find(call);
  return found == calls_.end() ? nullptr : &found->second;
}

void PendingCalls::forget(PendingCall& pending) {
  detach(pending);
  calls_.erase(fabric::CallId(pending.id()));
}

void PendingCalls::assign(PendingCall& pending, Instance& instance) {
  detach(pending);
  pending.at = &instance;
  instance.calls.push_back(&pending);
  Instances::change_load(instance, [](Load& load) { ++load.running; });
}

void PendingCalls::queue(PendingCall& pending) {
  if (pending.place != PendingCall::Place::queued) {
    detach(pending);
    pending.place = PendingCall::Place::queued;
    waiting_[pending.uuid].emplace(pending.number, &pending);
  }
}

void PendingCalls::hold(PendingCall& pending) {
  detach(pending);
  pending.place = PendingCall::Place::held;
  held_.emplace(pending.number, &pending);
}

const PendingCalls::Queue* PendingCalls::waiting(const std::string& uuid) const {
  const auto queue = waiting_.find(uuid);
  return queue == waiting_.end() ? nullptr : &queue->second;
}

void PendingCalls::note_waiters(Instance& instance) {
  instance.load.has_waiter = std::ranges::any_of(
      instance.calls, [](const PendingCall* pending) { return pending->assignment.waits; });
}

/// Removes the call from its instance and from the pending calls.
void PendingCalls::detach(PendingCall& pending) {
  if (Instance* const from = std::exchange(pending.at, nullptr)) {
    std::erase(from->calls, &pending);
    Instances::change_load(*from, [&](Load& load) {
      --load.running;
      if (pending.assignment.waits) {
        note_waiters(*from);
      }
    });
  }
  pending.published = {};
  pending.assignment.waits = false;
  const auto place = std::exchange(pending.place, PendingCall::Place::none);
  if (place == PendingCall::Place::held) {
    held_.erase(pending.number);
  } else if (place == PendingCall::Place::queued) {
    const auto queue = waiting_.find(pending.uuid);
    queue->second.erase(pending.number);
    if (queue->second.empty()) {
      waiting_.erase(queue);
    }
  }
}

}  // namespace millrace::gateway::dispatch
