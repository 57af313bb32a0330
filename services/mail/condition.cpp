#include "services/mail/condition.hpp"

#include <fmt/format.h>

namespace millrace::services::mail {

namespace {

using fabric::AlarmLevel;

std::string mails(std::uint64_t count, std::string_view does_one, std::string_view do_many) {
  return count == 1 ? fmt::format("1 mail {}", does_one)
                    : fmt::format("{} mails {}", count, do_many);
}

}  // namespace

void Condition::tried(const Outcome& outcome, std::optional<Stage> stage, bool program_waits) {
  if (outcome.verdict == Verdict::insecure || outcome.verdict == Verdict::login) {
    server_trouble_ = outcome.reply;
  } else if (outcome.contact) {
    server_trouble_.reset();
  }
  if (stage == Stage::waiting) {
    reason_ = outcome.reply;
  } else if (stage && stage != Stage::accepted && !program_waits) {
    ++not_sent_;
    last_not_sent_ = outcome.reply;
  }
}

void Condition::waiting(std::size_t mails, Time now) {
  if (waiting_ == 0 && mails > 0) {
    waiting_since_ = now;
  }
  waiting_ = mails;
  now_ = now;
}

void Condition::tell(fabric::AlarmSink& alarms) const {
  if (server_trouble_) {
    alarms.raise({.key = {.kind = "mail_server"},
                  .level = AlarmLevel::problem,
                  .text = fmt::format("no login at {}, or no safe connection: {}", server_,
                                      *server_trouble_),
                  .advice = "correct the server's user, password or certificate"});
  } else {
    alarms.clear("mail_server", "");
  }
  if (waiting_ > 0) {
    alarms.raise(
        {.key = {.kind = "mail_queue"},
         .level = now_ - waiting_since_ < patience ? AlarmLevel::warning : AlarmLevel::problem,
         .text = fmt::format("{} for {}: {}", mails(waiting_, "waits", "wait"), server_,
                             reason_.empty() ? "left by the last run, not yet tried" : reason_),
         .advice = "check the mail server; the mails are tried again by themselves"});
  } else {
    alarms.clear("mail_queue", "");
  }
  if (not_sent_ > 0) {
    alarms.raise({.key = {.kind = "mails_not_sent"},
                  .level = AlarmLevel::warning,
                  .text = fmt::format("{} failed or uncertain since the start; the last: {}",
                                      mails(not_sent_, "was", "were"), last_not_sent_),
                  .advice = "the mails are in the spool; the log names their calls"});
  }
  if (spool_trouble_) {
    alarms.raise(
        {.key = {.kind = "spool"},
         .level = AlarmLevel::problem,
         .text = *spool_trouble_,
         .advice = "free space on the disk, or restore the folder; until then no mail is sent"});
  } else {
    alarms.clear("spool", "");
  }
}

}  // namespace millrace::services::mail
