#include "gateway/dispatch/jobs.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace millrace::gateway::dispatch {

Job& Jobs::enter(Job job) {
  job.number = ++entered_;
  const fabric::CallId call = job.call;
  return jobs_.insert_or_assign(call, std::move(job)).first->second;
}

Job* Jobs::find(const fabric::CallId& call) {
  const auto found = jobs_.find(call);
  return found == jobs_.end() ? nullptr : &found->second;
}

void Jobs::forget(Job& job) {
  take(job);
  jobs_.erase(fabric::CallId(job.call));
}

void Jobs::hand_over(Job& job, Instance& instance) {
  take(job);
  job.at = &instance;
  Instances::change_load(instance, [&] {
    instance.jobs.push_back(&job);
    ++instance.running;
  });
}

void Jobs::queue(Job& job) {
  if (!job.queued) {
    take(job);
    job.queued = true;
    waiting_[job.uuid].emplace(job.number, &job);
  }
}

void Jobs::hold(Job& job) {
  take(job);
  job.held = true;
  held_.emplace(job.number, &job);
}

const Jobs::Queue* Jobs::waiting(const std::string& uuid) const {
  const auto queue = waiting_.find(uuid);
  return queue == waiting_.end() ? nullptr : &queue->second;
}

void Jobs::note_waiters(Instance& instance) {
  instance.has_waiter = std::ranges::any_of(instance.jobs, &Job::waits);
}

/// From whoever has it, and from where it waits.
void Jobs::take(Job& job) {
  if (Instance* const from = std::exchange(job.at, nullptr)) {
    Instances::change_load(*from, [&] {
      std::erase(from->jobs, &job);
      --from->running;
      note_waiters(*from);
    });
  }
  job.published_at.reset();
  job.unknown = 0;
  job.waits = false;
  if (std::exchange(job.held, false)) {
    held_.erase(job.number);
  }
  if (std::exchange(job.queued, false)) {
    const auto queue = waiting_.find(job.uuid);
    queue->second.erase(job.number);
    if (queue->second.empty()) {
      waiting_.erase(queue);
    }
  }
}

}  // namespace millrace::gateway::dispatch
