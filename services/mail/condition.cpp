#include "services/mail/condition.hpp"

#include "base/messages/catalogue.hpp"

namespace millrace::services::mail {

namespace {

using fabric::AlarmLevel;

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
                  .text = base::messages::mail_server_refuses(server_, *server_trouble_),
                  .advice = base::messages::correct_mail_login()});
  } else {
    alarms.clear("mail_server", "");
  }
  if (waiting_ > 0) {
    const fabric::Message why =
        reason_.empty() ? base::messages::mails_not_tried() : fabric::Message(reason_);
    alarms.raise(
        {.key = {.kind = "mail_queue"},
         .level = now_ - waiting_since_ < patience ? AlarmLevel::warning : AlarmLevel::problem,
         .text = waiting_ == 1 ? base::messages::mail_waits(server_, why)
                               : base::messages::mails_wait(waiting_, server_, why),
         .advice = base::messages::check_mail_server()});
  } else {
    alarms.clear("mail_queue", "");
  }
  if (not_sent_ > 0) {
    alarms.raise({.key = {.kind = "mails_not_sent"},
                  .level = AlarmLevel::warning,
                  .text = not_sent_ == 1 ? base::messages::mail_failed(last_not_sent_)
                                         : base::messages::mails_failed(not_sent_, last_not_sent_),
                  .advice = base::messages::mails_in_spool()});
  }
  if (spool_trouble_) {
    alarms.raise({.key = {.kind = "spool"},
                  .level = AlarmLevel::problem,
                  .text = *spool_trouble_,
                  .advice = base::messages::mail_free_space()});
  } else {
    alarms.clear("spool", "");
  }
}

}  // namespace millrace::services::mail
