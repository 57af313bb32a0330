// What a mail service says of itself on the fabric: mails that wait and why, mails that were not
// sent, a spool that cannot be used. Pure.
//
//   condition.tried(outcome, false, now);
//   condition.waiting(3, now);
//   condition.tell(notices);
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "fabric/notice_sink.hpp"
#include "services/mail/mail.hpp"
#include "services/mail/outcome.hpp"

namespace millrace::services::mail {

class Condition {
 public:
  using Time = std::chrono::steady_clock::time_point;
  /// Mails that wait longer than this need somebody. Our choice: the longest pause between two
  /// attempts, unless it is configured.
  static constexpr std::chrono::minutes patience{15};

  /// `server` as people know it, "mail.example.com:587".
  explicit Condition(std::string server) : server_(std::move(server)) {}

  /// An attempt has ended; `program_waits` for its answer and gets to know it. `stage` is what has
  /// become of the mail; nothing if it is not kept.
  void tried(const Outcome& outcome, std::optional<Stage> stage, bool program_waits);
  /// So many mails wait in the spool.
  void waiting(std::size_t mails, Time now);
  /// The spool was used: why that failed, or nothing if it worked.
  void spool(std::optional<std::string> trouble) { spool_trouble_ = std::move(trouble); }

  /// "mail_server", "mail_queue", "mails_not_sent" and "spool".
  void tell(fabric::NoticeSink& notices) const;

 private:
  std::string server_;
  std::size_t waiting_ = 0;
  Time waiting_since_{};
  Time now_{};
  /// Of the last attempt that left a mail waiting.
  std::string reason_;
  /// The server does not let this service in, or cannot be trusted: nothing but a person helps.
  std::optional<std::string> server_trouble_;
  std::uint64_t not_sent_ = 0;
  std::string last_not_sent_;
  std::optional<std::string> spool_trouble_;
};

}  // namespace millrace::services::mail
