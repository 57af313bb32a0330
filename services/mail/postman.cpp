#include "services/mail/postman.hpp"

#include <algorithm>
#include <vector>

#include <spdlog/spdlog.h>

#include "services/mail/answering.hpp"

namespace millrace::services::mail {

namespace {

using sdk::Response;

/// How often old calls are forgotten, if nothing else happens.
constexpr std::chrono::hours look_around{1};

bool is_done(Stage stage) {
  return stage == Stage::accepted || stage == Stage::refused;
}

}  // namespace

Postman::Postman(Config config, Spool spool, Transport& transport, base::program::Log log)
    : config_(std::move(config)),
      spool_(std::move(spool)),
      transport_(transport),
      log_(std::move(log)) {
  read_spool();
  thread_ = std::thread([this] { run(); });
}

Postman::~Postman() {
  {
    const Lock lock(lock_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Postman::read_spool() {
  Spool::Content content = spool_.read();
  for (const std::string& mistake : content.mistakes) {
    log_->error("{}\nIts mail is not sent again.", mistake);
  }
  std::size_t waiting = 0;
  std::optional<fabric::Time> last;
  for (Entry& entry : content.entries) {
    if (entry.stage == Stage::handed_over) {
      log_->warn(
          "call {}: its mail was handed over, but no answer of the server is known; it is "
          "not sent again",
          entry.call.to_string());
    }
    last = std::max(last.value_or(entry.made), entry.made);
    waiting += entry.stage == Stage::waiting ? 1 : 0;
    entries_.insert_or_assign(entry.call, std::move(entry));
  }
  clock_.emplace("the calls that the spool knows", last, base::loop::clocks_now());
  log_->info("the spool has {} mails that wait and knows {} calls", waiting, entries_.size());
}

Response Postman::answer(const CallInfo& call) {
  if (call.replayed && !config_.send_replayed) {
    const auto mail = compose(config_, call, std::chrono::system_clock::now());
    return mail ? answer_to({.verdict = Verdict::accepted}) : mail.error();
  }
  Lock lock(lock_);
  changed_.wait(lock, [&] { return !busy_.contains(call.call); });
  const auto known = entries_.find(call.call);
  if (known != entries_.end()) {
    const Entry entry = known->second;
    // Not yet tried: the process ended in between.
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

Response Postman::first_attempt(Lock& lock, const Entry& entry) {
  busy_.insert(entry.call);
  lock.unlock();
  const auto kept = spool_.put(entry);
  lock.lock();
  if (!kept) {
    busy_.erase(entry.call);
    changed_.notify_all();
    log_->error("call {}: nothing is sent: {}", entry.call.to_string(), kept.error());
    return text::error(state_spool, "nothing sent, the spool cannot be written: " + kept.error());
  }
  return answer_to(attempt(lock, entry, true));
}

Outcome Postman::send(const Entry& entry) {
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

Outcome Postman::attempt(Lock& lock, const Entry& entry, bool program_waits) {
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
  if (!outcome.contact) {
    pause_until_ = std::chrono::system_clock::now() + config_.retry.first;
  }
  busy_.erase(entry.call);
  changed_.notify_all();
  return outcome;
}

void Postman::keep(Lock& lock, const Entry& entry) {
  if (const auto kept = spool_.put(entry); !kept) {
    log_->error("call {}: what became of its mail is not written down: {}", entry.call.to_string(),
                kept.error());
  }
  lock.lock();
  entries_.insert_or_assign(entry.call, entry);
}

void Postman::drop(Lock& lock, fabric::CallId call) {
  if (const auto gone = spool_.remove(call); !gone) {
    log_->error("call {}: {}", call.to_string(), gone.error());
  }
  lock.lock();
  entries_.erase(call);
}

void Postman::tell(const Entry& entry, const Outcome& outcome) const {
  const std::string call = entry.call.to_string();
  switch (outcome.verdict) {
    case Verdict::accepted:
      log_->info("call {}: the mail server has its mail: {}", call, outcome.reply);
      return;
    case Verdict::refused:
      log_->error("call {}: the mail server refuses its mail: {}", call, outcome.reply);
      return;
    case Verdict::doubt:
      log_->error("call {}: its mail was handed over and no answer came, it is not sent again: {}",
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
      log_->warn("call {}: its mail is not taken for now (attempt {}): {}", call, entry.attempts,
                 outcome.reply);
      break;
  }
  if (entry.stage == Stage::given_up) {
    log_->error("call {}: its mail is given up; it stays in the spool", call);
  }
}

void Postman::run() {
  Lock lock(lock_);
  while (!stopping_) {
    const fabric::Time time = std::chrono::system_clock::now();
    fabric::Time wake = time + look_around;
    if (const Entry* entry = due(time, wake)) {
      attempt(lock, Entry(*entry), false);
      continue;
    }
    if (believes_clock()) {
      forget_old(lock, time);
    }
    changed_.wait_for(lock, wake - time);
  }
}

bool Postman::believes_clock() {
  const bool believes = clock_->believes(base::loop::clocks_now());
  if (const auto news = clock_->news()) {
    log_->warn("{}", *news);
  }
  return believes;
}

const Entry* Postman::due(fabric::Time now, fabric::Time& wake) const {
  for (const auto& [call, entry] : entries_) {
    if (entry.stage != Stage::waiting || busy_.contains(call)) {
      continue;
    }
    // A clock that was put back must not make a mail wait for days.
    const fabric::Time latest = now + config_.retry.longest;
    const fabric::Time next = std::max(std::min(entry.next, latest), pause_until_);
    if (next <= now || entry.next > latest) {
      return &entry;
    }
    wake = std::min(wake, next);
  }
  return nullptr;
}

void Postman::forget_old(Lock& lock, fabric::Time now) {
  std::vector<fabric::CallId> old;
  for (const auto& [call, entry] : entries_) {
    // What somebody may want to look at stays: mails that were kept and then refused or given up.
    if (is_done(entry.stage) && entry.mail.message.empty() &&
        now - entry.made >= config_.remember && !busy_.contains(call)) {
      old.push_back(call);
    }
  }
  for (const fabric::CallId call : old) {
    lock.unlock();
    drop(lock, call);
  }
}

}  // namespace millrace::services::mail
