// The way to a mail server, as the postman sees it.
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
    /// Called once, before the last byte of the message leaves; false = it must not.
    std::function<bool()> handing_over;
    /// Asked from time to time until then; true = give up, the mail is to be sent later.
    std::function<bool()> cancelled;
  };

  /// One attempt; returns when it has ended.
  virtual Outcome send(const Mail& mail, const Watch& watch) = 0;

 protected:
  Transport() = default;
  Transport(const Transport&) = default;
  Transport& operator=(const Transport&) = default;
};

}  // namespace millrace::services::mail
