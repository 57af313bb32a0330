// The interface between the mail_sender and a mail server.
#pragma once

#include <functional>

#include "services/mail/mail.hpp"
#include "services/mail/outcome.hpp"

namespace millrace::services::mail {

/// Functions may be called from any thread.
class Transport {
 public:
  virtual ~Transport() = default;

  struct Watch {
    /// Called once, before the last byte of the message is sent; false = do not send it.
    std::function<bool()> handing_over;
    /// Called periodically until then; true = cancel, the mail is sent later.
    std::function<bool()> cancelled;
  };

  /// Makes one attempt; returns when it has ended.
  virtual Outcome send(const Mail& mail, const Watch& watch) = 0;

 protected:
  Transport() = default;
  Transport(const Transport&) = default;
  Transport& operator=(const Transport&) = default;
};

}  // namespace millrace::services::mail
