#include "services/mail/mail_sender.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "services/mail/answering.hpp"

namespace millrace::services::mail {

namespace {

using sdk::Response;

/// How often old calls are removed without other events.
constexpr std::chrono::hours look_around{1};
/// How often an unusable spool is tried again.
constexpr std::chrono::seconds spool_pause{10};

}  // namespace

MailSender::MailSender(Config config, Spool spool, Transport& transport, base::program::Log log,
                       fabric::AlarmSink& alarms)
    : config_(std::move(config)),
      spool_(std::move(spool)),
      transport_(transport),
      log_(std::move(log)),
      alarms_(alarms),
      condition_(fmt::format("{}:{}", config_.server.host, config_.server.port)) {
  read_spool();
  report_condition();
  thread_ = std::thread([this] { run(Lane::ordinary); });
  stalled_thread_ = std::thread([this] { run(Lane::stalled); });
}

MailSender::~MailSender() {
  {
    const Lock lock(lock_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
  stalled_thread_.join();
}

void MailSender::read_spool() {
  auto content = spool_.content();
  if (!content) {
    throw std::runtime_error(content.error());
  }
  for (const fabric::CallId call : content->in_doubt) {
    log_->warn(
        "call {}: its mail was handed over, but no answer of the server is known; it is "
        "not sent again",
        call.to_string());
  }
  waiting_ = std::move(content->waiting);
  clock_.emplace("the calls that the spool knows", content->last, base::loop::clocks_now());
  log_->info("the spool has {} mails that wait and knows {} calls", waiting_.size(),
             content->calls);
}

void MailSender::report_condition() {
  condition_.waiting(waiting_.size(), std::chrono::steady_clock::now());
  condition_.tell(alarms_);
}

template <typename Value>
void MailSender::note_spool(const Spool::Result<Value>& result) {
  condition_.spool(result ? std::nullopt : std::optional(result.error()));
  report_condition();
}

Spool::Result<std::optional<Entry>> MailSender::known(fabric::CallId call) const {
  const auto unwritten = unwritten_.find(call);
  return unwritten != unwritten_.end() ? std::optional(unwritten->second) : spool_.find(call);
}

Response MailSender::answer(const fabric::Request& call) {
  if (call.replayed) {
    const auto mail = compose(config_, call, std::chrono::system_clock::now());
    return mail ? answer_to({.verdict = Verdict::accepted}) : mail.error();
  }
  Lock lock(lock_);
  changed_.wait(lock, [&] { return !busy_.contains(call.call); });
  const auto earlier = known(call.call);
  if (!earlier) {
    log_->error("call {}: nothing is sent: {}", call.call.to_string(), earlier.error());
    note_spool(earlier);
    return text::error(state_spool, "nothing sent, the spool cannot be read: " + earlier.error());
  }
  if (*earlier) {
    const Entry& entry = **earlier;
    // Not tried yet: the process ended in between.
    return entry.stage == Stage::waiting && entry.attempts == 0 ? first_attempt(lock, entry)
                                                                : answer_from(entry);
  }
  auto mail = compose(config_, call, std::chrono::system_clock::now());
  if (!mail) {
    return mail.error();
  }
  return first_attempt(
      lock,
      {.call = call.call, .mail = *std::move(mail), .made = std::chrono::system_clock::now()});
}

bool MailSender::post(fabric::CallId id, Mail mail) {
  Lock lock(lock_);
  const auto earlier = known(id);
  if (!earlier || *earlier || busy_.contains(id)) {
    if (!earlier) {
      log_->error("mail {} is not sent, the spool cannot be read: {}", id.to_string(),
                  earlier.error());
    }
    return false;
  }
  const fabric::Time now = std::chrono::system_clock::now();
  const Entry entry{.call = id, .mail = std::move(mail), .made = now, .next = now};
  busy_.insert(id);
  lock.unlock();
  const auto kept = spool_.put(entry);
  lock.lock();
  busy_.erase(id);
  if (kept) {
    note(entry);
  } else {
    log_->error("mail {} is not sent, the spool cannot be written: {}", id.to_string(),
                kept.error());
  }
  changed_.notify_all();
  return kept.has_value();
}

Response MailSender::first_attempt(Lock& lock, const Entry& entry) {
  busy_.insert(entry.call);
  lock.unlock();
  const auto kept = spool_.put(entry);
  lock.lock();
  note_spool(kept);
  if (!kept) {
    busy_.erase(entry.call);
    changed_.notify_all();
    log_->error("call {}: nothing is sent: {}", entry.call.to_string(), kept.error());
    return text::error(state_spool, "nothing sent, the spool cannot be written: " + kept.error());
  }
  return answer_to(attempt(lock, entry, true));
}

Outcome MailSender::send(const Entry& entry) {
  bool handed_over = false;
  const auto hand_over = [&] {
    Entry leaving = entry;
    leaving.stage = Stage::handed_over;
    const auto kept = spool_.put(leaving);
    if (!kept) {
      log_->error("call {}: {}", entry.call.to_string(), kept.error());
    }
    handed_over = kept.has_value();
    return handed_over;
  };
  const auto cancelled = [this] {
    const Lock guard(lock_);
    return stopping_;
  };
  try {
    return transport_.send(entry.mail, {.handing_over = hand_over, .cancelled = cancelled});
  } catch (const std::exception& error) {
    return {.verdict = handed_over ? Verdict::doubt : Verdict::later, .reply = error.what()};
  }
}

Outcome MailSender::attempt(Lock& lock, const Entry& entry, bool program_waits) {
  busy_.insert(entry.call);
  lock.unlock();
  Outcome outcome = send(entry);
  const auto result =
      after(entry, outcome, config_.retry, program_waits, std::chrono::system_clock::now());
  tell(result.value_or(entry), outcome);
  if (result) {
    keep(lock, *result);
  } else {
    drop(lock, entry.call);
  }
  if (outcome.stalled && waiting_.contains(entry.call)) {
    stalled_.insert(entry.call);
  } else {
    stalled_.erase(entry.call);
  }
  condition_.tried(outcome, result ? std::optional(result->stage) : std::nullopt, program_waits);
  report_condition();
  if (!outcome.contact) {
    pause_until_ = std::chrono::steady_clock::now() + config_.retry.first;
  }
  busy_.erase(entry.call);
  changed_.notify_all();
  return outcome;
}

void MailSender::keep(Lock& lock, const Entry& entry) {
  const auto kept = spool_.put(entry);
  if (!kept) {
    log_->error("call {}: the outcome of its mail is not in the spool yet: {}",
                entry.call.to_string(), kept.error());
  }
  lock.lock();
  note(entry);
  note_spool(kept);
  if (kept) {
    unwritten_.erase(entry.call);
  } else {
    unwritten_.insert_or_assign(entry.call, entry);
    next_tidying_ = std::min(next_tidying_, std::chrono::steady_clock::now() + spool_pause);
  }
}

void MailSender::drop(Lock& lock, fabric::CallId call) {
  const auto gone = spool_.remove(call);
  if (!gone) {
    log_->error("call {}: {}", call.to_string(), gone.error());
  }
  lock.lock();
  note_spool(gone);
  waiting_.erase(call);
  unwritten_.erase(call);
}

void MailSender::note(const Entry& entry) {
  if (entry.stage == Stage::waiting) {
    waiting_.insert_or_assign(entry.call, entry.next);
  } else {
    waiting_.erase(entry.call);
  }
}

void MailSender::tell(const Entry& entry, const Outcome& outcome) const {
  const std::string call = entry.call.to_string();
  switch (outcome.verdict) {
    case Verdict::accepted:
      log_->info("call {}: the mail server has its mail: {}", call, outcome.reply);
      return;
    case Verdict::refused:
      log_->error("call {}: the mail server refuses its mail: {}", call, outcome.reply);
      return;
    case Verdict::doubt:
      log_->error(
          "call {}: its mail was handed over, but the server did not respond; it is not sent "
          "again: {}",
          call, outcome.reply);
      return;
    case Verdict::insecure:
    case Verdict::login:
      log_->error("call {}: {}: {}", call,
                  outcome.verdict == Verdict::login ? "no login at the mail server"
                                                    : "no safe connection to the mail server",
                  outcome.reply);
      break;
    case Verdict::later:
      log_->warn("call {}: the server does not accept its mail for now (attempt {}): {}", call,
                 entry.attempts, outcome.reply);
      break;
  }
  if (entry.stage == Stage::given_up) {
    log_->error("call {}: the service has stopped trying to send its mail; it stays in the spool",
                call);
  }
}

void MailSender::run(Lane lane) {
  Lock lock(lock_);
  while (!stopping_) {
    const fabric::Time time = std::chrono::system_clock::now();
    std::chrono::nanoseconds wait = look_around;
    if (const auto call = due(lane, time, wait)) {
      try_again(lock, *call);
      continue;
    }
    if (lane == Lane::stalled) {
      changed_.wait_for(lock, wait);
      continue;
    }
    const auto steady = std::chrono::steady_clock::now();
    if (steady >= next_tidying_) {
      next_tidying_ = steady + look_around;
      write_again(lock);
      if (believes_clock()) {
        forget_old(lock, time);
      }
      // The lock was released in between.
      continue;
    }
    changed_.wait_for(lock, std::min<std::chrono::nanoseconds>(wait, next_tidying_ - steady));
  }
}

void MailSender::try_again(Lock& lock, fabric::CallId call) {
  const auto entry = known(call);
  if (!entry) {
    log_->error("call {}: its mail is tried again later: {}", call.to_string(), entry.error());
    note_spool(entry);
    pause_until_ = std::chrono::steady_clock::now() + spool_pause;
    return;
  }
  if (!*entry || (*entry)->stage != Stage::waiting) {
    // The spool was changed from outside.
    waiting_.erase(call);
    return;
  }
  attempt(lock, **entry, false);
}

void MailSender::write_again(Lock& lock) {
  const auto entries = unwritten_;
  for (const auto& [call, entry] : entries) {
    if (busy_.insert(call).second) {
      lock.unlock();
      keep(lock, entry);
      busy_.erase(call);
      changed_.notify_all();
    }
  }
}

bool MailSender::believes_clock() {
  const bool believes = clock_->believes(base::loop::clocks_now());
  if (const auto news = clock_->news()) {
    log_->warn("{}", *news);
  }
  return believes;
}

std::optional<fabric::CallId> MailSender::due(Lane lane, fabric::Time now,
                                              std::chrono::nanoseconds& wait) const {
  const std::chrono::nanoseconds pause = pause_until_ - std::chrono::steady_clock::now();
  std::optional<fabric::CallId> longest;
  fabric::Time since = fabric::Time::max();
  for (const auto& [call, wanted] : waiting_) {
    if (busy_.contains(call) || stalled_.contains(call) != (lane == Lane::stalled)) {
      continue;
    }
    // No attempt is planned later than that: the clock was set back, which must not delay a mail
    // for days.
    const bool is_planned = wanted <= now + config_.retry.longest;
    const std::chrono::nanoseconds left =
        std::max(pause, is_planned ? wanted - now : std::chrono::nanoseconds{});
    if (left.count() > 0) {
      wait = std::min(wait, left);
    } else if (wanted < since) {
      longest = call;
      since = wanted;
    }
  }
  return longest;
}

void MailSender::forget_old(Lock& lock, fabric::Time now) {
  lock.unlock();
  const auto forgotten = spool_.forget(now - config_.remember);
  lock.lock();
  if (!forgotten) {
    log_->error("old calls cannot be removed from the spool: {}", forgotten.error());
  }
}

}  // namespace millrace::services::mail
