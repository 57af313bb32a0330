// Sends the mails of calls, each at most once, and repeats attempts that a server refuses
// temporarily.
//
// At most once also holds over crashes. A mail is in the spool before the server is contacted; the
// spool records the handover before the last byte is sent; after that the mail is only sent again
// if the server has replied that it did not accept it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include "base/loop/clock_watch.hpp"
#include "base/program/log.hpp"
#include "services/mail/compose.hpp"
#include "services/mail/condition.hpp"
#include "services/mail/mail.hpp"
#include "services/mail/spool.hpp"

namespace millrace::services::mail {

/// Functions may be called from any thread.
class MailSender {
 public:
  /// `transport` and `alarms`, which gets its alarms, must outlive it. Mails that wait in the
  /// spool are tried from now on.
  MailSender(Config config, Spool spool, Transport& transport, base::program::Log log,
             fabric::AlarmSink& alarms);
  /// Cancels attempts that are not handed over; their mails are in the spool.
  ~MailSender();
  MailSender(const MailSender&) = delete;
  MailSender& operator=(const MailSender&) = delete;

  /// Sends the mail of the call and returns after the first attempt. For a repeated call, returns
  /// the stage of the earlier mail.
  sdk::Response answer(const fabric::Request& call);

  /// Takes a mail without a waiting NC program. False if it was posted before, or cannot be stored,
  /// which is logged: a mail that is not in the spool is not sent.
  bool post(fabric::CallId id, Mail mail);

 private:
  using Lock = std::unique_lock<std::mutex>;
  /// Mails whose last attempt timed out at the server are tried in a separate thread, so that the
  /// others do not wait for them.
  enum class Lane : std::uint8_t { ordinary, stalled };

  void read_spool();
  /// The stored state of a call, if it is known.
  Spool::Result<std::optional<Entry>> known(fabric::CallId call) const;
  /// Makes the first attempt of a call, and returns the response.
  sdk::Response first_attempt(Lock& lock, const Entry& entry);
  /// One attempt, without the lock; the entry is the one in the spool.
  Outcome attempt(Lock& lock, const Entry& entry, bool program_waits);
  Outcome send(const Entry& entry);
  /// Both write to the spool without the lock and take it afterwards.
  void keep(Lock& lock, const Entry& entry);
  void drop(Lock& lock, fabric::CallId call);
  /// Needs the lock: updates what is known about the entry without reading the spool.
  void note(const Entry& entry);
  void tell(const Entry& entry, const Outcome& outcome) const;

  /// Needs the lock: reports the current alarms.
  void report_condition();
  /// The same, after a use of the spool with this result.
  template <typename Value>
  void note_spool(const Spool::Result<Value>& result);

  void run(Lane lane);
  /// The call whose mail has been due for the longest time; if none is due, reduces `wait` to the
  /// time until one is.
  std::optional<fabric::CallId> due(Lane lane, fabric::Time now,
                                    std::chrono::nanoseconds& wait) const;
  void try_again(Lock& lock, fabric::CallId call);
  /// Writes the entries that could not be stored before.
  void write_again(Lock& lock);
  void forget_old(Lock& lock, fabric::Time now);
  bool believes_clock();

  Config config_;
  Spool spool_;
  Transport& transport_;
  base::program::Log log_;
  fabric::AlarmSink& alarms_;
  Condition condition_;
  mutable std::mutex lock_;
  std::condition_variable changed_;
  /// The waiting mails, and the time of the next attempt of each.
  std::map<fabric::CallId, fabric::Time> waiting_;
  /// Waiting mails whose last attempt timed out at the server.
  std::set<fabric::CallId> stalled_;
  /// Entries that could not be written to the spool; they are newer than those in the spool.
  std::map<fabric::CallId, Entry> unwritten_;
  /// Calls with an attempt in progress.
  std::set<fabric::CallId> busy_;
  /// Old calls are removed only by a trusted clock: a repeated call sends a second mail after its
  /// removal.
  std::optional<base::loop::ClockWatch> clock_;
  /// No contact: no attempt before this time, whatever happens to the wall clock.
  std::chrono::steady_clock::time_point pause_until_{};
  /// Time of the next removal of old calls and of the next attempt to store entries.
  std::chrono::steady_clock::time_point next_tidying_{};
  bool stopping_ = false;
  std::thread thread_;
  std::thread stalled_thread_;
};

}  // namespace millrace::services::mail
