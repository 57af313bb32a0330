// Watches the fabric for occasions of rules, on its own thread, and passes their mails to the
// mail_sender.
#pragma once

#include <memory>

#include "base/program/log.hpp"
#include "fabric/dds/participant.hpp"
#include "services/mail/config.hpp"
#include "services/mail/mail_sender.hpp"

namespace millrace::services::mail {

class RuleThread {
 public:
  /// `mail_sender` must outlive it. Throws std::runtime_error if joining the fabric fails.
  RuleThread(const fabric::dds::ParticipantOptions& join, const Config& config,
             MailSender& mail_sender, base::program::Log log);
  ~RuleThread();
  RuleThread(const RuleThread&) = delete;
  RuleThread& operator=(const RuleThread&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::services::mail
