// The alarms of the mail service on the fabric: waiting mails and the reason, mails that were not
// sent, an unusable spool. Pure.
//
//   condition.tried(outcome, false, now);
//   condition.waiting(3, now);
//   condition.tell(alarms);
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "fabric/alarm.hpp"
#include "services/mail/mail.hpp"

namespace millrace::services::mail {

class Condition {
 public:
  using Time = std::chrono::steady_clock::time_point;
  /// Mails that wait longer than this need attention. Our choice: the default of the longest pause
  /// between two attempts.
  static constexpr std::chrono::minutes patience{15};

  /// `server` as people know it, "mail.example.com:587".
  explicit Condition(std::string server) : server_(std::move(server)) {}

  /// An attempt has ended; with `program_waits`, an NC program gets the response. `stage` is the
  /// new stage of the mail; nullopt if it is not stored.
  void tried(const Outcome& outcome, std::optional<Stage> stage, bool program_waits);
  /// The number of mails that wait in the spool.
  void waiting(std::size_t mails, Time now);
  /// The spool was used: the reason of a failure, or nullopt on success.
  void spool(std::optional<std::string> trouble) { spool_trouble_ = std::move(trouble); }

  /// Raises "mail_server", "mail_queue", "mails_not_sent" and "spool"; clears all but
  /// "mails_not_sent" when they are over.
  void tell(fabric::AlarmSink& alarms) const;

 private:
  std::string server_;
  std::size_t waiting_ = 0;
  Time waiting_since_{};
  Time now_{};
  /// Reply of the last attempt that left a mail waiting.
  std::string reason_;
  /// The server refuses the login, or the connection is not safe: an operator must act.
  std::optional<std::string> server_trouble_;
  std::uint64_t not_sent_ = 0;
  std::string last_not_sent_;
  std::optional<std::string> spool_trouble_;
};

}  // namespace millrace::services::mail
