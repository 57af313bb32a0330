// SMTP through libcurl: one connection per mail, STARTTLS as configured.
//
//   Smtp smtp(config.server);
//   const Outcome outcome = smtp.send(mail, {.handing_over = …, .cancelled = …});
#pragma once

#include <mutex>

#include "services/mail/config.hpp"
#include "services/mail/mail.hpp"

namespace millrace::services::mail {

class Smtp : public Transport {
 public:
  explicit Smtp(ServerConfig server);
  ~Smtp() override;
  Smtp(const Smtp&) = delete;
  Smtp& operator=(const Smtp&) = delete;

  /// Throws std::runtime_error if libcurl cannot be used.
  Outcome send(const Mail& mail, const Watch& watch) override;

 private:
  void begin();

  std::mutex lock_;
  bool began_ = false;
  ServerConfig server_;
};

}  // namespace millrace::services::mail
