#include "services/sdk/runner.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include "base/messages/catalogue.hpp"

namespace millrace::services::sdk {

namespace {

fabric::Moment now() {
  return {std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
}

double milliseconds(std::chrono::nanoseconds duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

/// The CPU time of this thread, from the kernel.
struct OwnTime {
  std::chrono::nanoseconds processor{};
  /// The number of times it has waited.
  long waits = 0;

  /// Whether it has used the CPU for this long since, or waited for anything.
  [[nodiscard]] bool is_to_blame(const OwnTime& before, std::chrono::nanoseconds limit) const {
    return processor - before.processor > limit || waits > before.waits;
  }
};

OwnTime own_time() {
  rusage use{};
  ::getrusage(RUSAGE_THREAD, &use);
  const auto of = [](const timeval& time) {
    return std::chrono::seconds(time.tv_sec) + std::chrono::microseconds(time.tv_usec);
  };
  return {of(use.ru_utime) + of(use.ru_stime), use.ru_nvcsw};
}

const char* describe(fabric::ServiceCode code) {
  switch (code) {
    case fabric::ServiceCode::ok:
      return "answered";
    case fabric::ServiceCode::failed:
      return "failed";
    case fabric::ServiceCode::repeated:
      return "answered again from memory";
    case fabric::ServiceCode::refused:
      return "answer refused";
  }
  return "answered";
}

void log_reply(spdlog::logger& log, const fabric::Reply& reply) {
  const bool good =
      reply.code == fabric::ServiceCode::ok || reply.code == fabric::ServiceCode::repeated;
  const char* what =
      reply.kind == fabric::ReplyKind::interim ? "is in progress" : describe(reply.code);
  const auto level = good ? spdlog::level::debug : spdlog::level::warn;
  if (!log.should_log(level)) {
    return;
  }
  log.log(level, "call {} {}: {:?}, state {}, after {:.3f} ms", reply.call.to_string(), what,
          reply.text, reply.state, milliseconds(reply.answered - reply.received));
}

}  // namespace

Runner::Runner(CallSchedulerOptions options, Service::Log log, InlineHandler inline_handler,
               std::function<void()> requested)
    : log_(std::move(log)),
      scheduler_(options),
      inline_handler_(std::move(inline_handler)),
      requested_(std::move(requested)) {}

void Runner::set_endpoint(fabric::endpoints::ReplyPublisher* endpoint) {
  Lock lock(lock_);
  endpoint_ = endpoint;
  perform(std::move(lock), {});
}

void Runner::on_request(const fabric::Request& request) {
  if (requested_) {
    requested_();
  }
  Lock lock(lock_);
  if (closed_) {
    perform(std::move(lock), scheduler_.decline(request, base::messages::instance_leaving()));
    return;
  }
  const Actions actions = scheduler_.on_request(request, now());
  // Without a known end an answer would be dropped.
  const bool here = fast_enough_ && endpoint_ != nullptr;
  perform(std::move(lock), actions, here ? Place::here : Place::workers);
}

void Runner::on_withdrawn(const fabric::RequestKey& key) {
  Lock lock(lock_);
  const Actions actions = scheduler_.on_withdrawn(key);
  perform(std::move(lock), actions);
}

void Runner::on_orphaned(const fabric::RequestKey& key) {
  Lock lock(lock_);
  const Actions actions = scheduler_.on_orphaned(key);
  perform(std::move(lock), actions);
}

void Runner::on_ignored(const std::string& reason) {
  log_->warn("{}", reason);
}

void Runner::interim(fabric::CallId call, const Response& response) {
  Lock lock(lock_);
  const Actions actions = scheduler_.on_interim(call, response, now());
  perform(std::move(lock), actions);
}

void Runner::finished(fabric::CallId call, const Result& result) {
  Lock lock(lock_);
  cancelled_.erase(call);
  const Actions actions = scheduler_.on_result(call, result, now());
  perform(std::move(lock), actions);
  if (!result) {
    log_->warn("call {} failed: {}", call.to_string(), result.error());
  }
}

void Runner::declined(fabric::CallId call, const std::string& reason) {
  Lock lock(lock_);
  cancelled_.erase(call);
  const Actions actions = scheduler_.on_declined(call, reason, now());
  perform(std::move(lock), actions);
}

std::shared_ptr<const Call> Runner::next(std::chrono::steady_clock::time_point end) {
  Lock lock(lock_);
  const auto something = [this] { return !work_.empty() || closed_; };
  if (end == std::chrono::steady_clock::time_point::max()) {
    changed_.wait(lock, something);
  } else {
    changed_.wait_until(lock, end, something);
  }
  if (work_.empty()) {
    return nullptr;
  }
  auto call = std::move(work_.front());
  work_.pop_front();
  lock.unlock();
  announce(*call);
  return call;
}

void Runner::close_when_idle() {
  const Lock lock(lock_);
  closing_ = true;
  closed_ = closed_ || scheduler_.idle();
  changed_.notify_all();
}

void Runner::close() {
  const Lock lock(lock_);
  closed_ = true;
  changed_.notify_all();
}

bool Runner::closed() const {
  const Lock lock(lock_);
  return closed_;
}

std::size_t Runner::remembered() const {
  const Lock lock(lock_);
  return cancelled_.size();
}

fabric::InstanceLoad Runner::load() const {
  const Lock lock(lock_);
  return scheduler_.load();
}

void Runner::perform(Lock lock, const Actions& actions, Place place) {
  std::vector<std::string> trouble;
  std::vector<std::stop_source> cancelled;
  for (const Action& action : actions) {
    if (const auto* start = std::get_if<Start>(&action)) {
      perform(*start);
    } else if (const auto* send = std::get_if<Send>(&action)) {
      perform(*send, trouble);
    } else if (const auto* cancel = std::get_if<Cancel>(&action)) {
      perform(*cancel, cancelled);
    }
  }
  closed_ = closed_ || (closing_ && scheduler_.idle());
  const bool all = closed_;
  std::vector<std::shared_ptr<const Call>> here;
  if (place == Place::here || (inline_handler_.forwards && endpoint_ != nullptr)) {
    here.assign(work_.begin(), work_.end());
    work_.clear();
  }
  lock.unlock();
  for (std::stop_source& stop : cancelled) {
    stop.request_stop();
  }
  if (place == Place::workers || all) {
    wake_workers(actions, all);
  }
  for (const Action& action : actions) {
    log(action);
  }
  for (const std::string& lost : trouble) {
    log_->error(lost);
  }
  report_cancelled(actions);
  for (const auto& call : here) {
    run_here(call);
  }
}

void Runner::wake_workers(const Actions& actions, bool all) {
  if (all) {
    changed_.notify_all();
    return;
  }
  // One thread for each call: to wake them all for each would cost more than most handlers do.
  for (const Action& action : actions) {
    if (std::holds_alternative<Start>(action)) {
      changed_.notify_one();
    }
  }
}

void Runner::report_cancelled(const Actions& actions) const {
  if (!inline_handler_.cancelled) {
    return;
  }
  for (const Action& action : actions) {
    if (const auto* cancel = std::get_if<Cancel>(&action); cancel != nullptr && cancel->runs) {
      inline_handler_.cancelled(cancel->call);
    }
  }
}

void Runner::run_here(const std::shared_ptr<const Call>& call) {
  announce(*call);
  if (inline_handler_.forwards) {
    inline_handler_.handler(call);
    return;
  }
  const auto start = std::chrono::steady_clock::now();
  const OwnTime before = own_time();
  inline_handler_.handler(call);
  const auto took = std::chrono::steady_clock::now() - start;
  // A busy host takes the processor from the fastest handler: that is not the handler's fault.
  if (took > inline_handler_.limit && own_time().is_to_blame(before, inline_handler_.limit)) {
    log_->warn(
        "the handler took {:.3f} ms for call {} in the receiving thread, where {:.3f} ms are "
        "allowed; calls run in their own threads from now on. Do not declare this service inline",
        milliseconds(took), call->id().to_string(), milliseconds(inline_handler_.limit));
    fast_enough_ = false;
  }
}

void Runner::announce(const Call& call) const {
  if (log_->should_log(spdlog::level::debug)) {
    log_->debug("call {} from {}: {:?}, state {}, attempt {}", call.id().to_string(),
                call.channel().to_string(), call.text(), call.state(), call.attempt());
  }
}

void Runner::perform(const Start& start) {
  const std::stop_source cancelled;
  cancelled_.insert_or_assign(start.request.call, cancelled);
  work_.push_back(std::make_shared<Call>(start.request, weak_from_this(), cancelled.get_token()));
}

void Runner::perform(const Send& send, std::vector<std::string>& trouble) {
  if (endpoint_ == nullptr) {
    return;
  }
  if (const auto sent = endpoint_->publish(send.reply); !sent) {
    trouble.push_back(fmt::format("the answer to call {} is lost: {}", send.reply.call.to_string(),
                                  sent.error()));
  }
}

void Runner::perform(const Cancel& cancel, std::vector<std::stop_source>& cancelled) {
  if (const auto call = cancelled_.find(cancel.call); cancel.runs && call != cancelled_.end()) {
    cancelled.push_back(call->second);
  }
}

void Runner::log(const Action& action) const {
  const auto* const send = std::get_if<Send>(&action);
  if (send != nullptr && send->reply.kind == fabric::ReplyKind::declined) {
    log_->debug("call {} is declined: {}", send->reply.call.to_string(), send->reply.text);
  } else if (send != nullptr) {
    log_reply(*log_, send->reply);
  } else if (const auto* cancel = std::get_if<Cancel>(&action)) {
    log_->debug("call {} is cancelled", cancel->call.to_string());
  } else if (const auto* drop = std::get_if<Drop>(&action)) {
    log_->debug("call {} was answered after it was cancelled; nothing is sent",
                drop->call.to_string());
  }
}

}  // namespace millrace::services::sdk
