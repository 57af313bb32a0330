// Sends the mails of calls, each at most once, and again and again those that a server does not
// take for now.
//
// At most once, over crashes, too: a mail is in the spool before the server hears of it; before its
// last byte leaves, the spool says so; and after that it is only sent again if the server has said
// that it did not take it.
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
#include "services/mail/spool.hpp"
#include "services/mail/transport.hpp"

namespace millrace::services::mail {

/// Functions may be called from any thread.
class Postman {
 public:
  /// `transport` and `notices`, which gets to know what troubles it, live longer. Mails that wait
  /// in the spool are tried from now on.
  Postman(Config config, Spool spool, Transport& transport, base::program::Log log,
          fabric::NoticeSink& notices);
  /// Gives up attempts that have not been handed over; they are in the spool.
  ~Postman();
  Postman(const Postman&) = delete;
  Postman& operator=(const Postman&) = delete;

  /// Sends what the call asks for and returns when the server has taken it, or has not. For a call
  /// that has been here before, tells what became of it.
  sdk::Response answer(const CallInfo& call);

  /// Takes over a mail that no program waits for. False if it has been here before, or cannot be
  /// kept, which the log says: what is not in the spool is not sent.
  bool post(fabric::CallId id, Mail mail);

 private:
  using Lock = std::unique_lock<std::mutex>;
  /// Mails over which the server has let the time run out are tried one after the other, beside the
  /// rest, which would wait for them.
  enum class Lane : std::uint8_t { ordinary, stalled };

  void read_spool();
  /// What became of the call, as far as it is known.
  Spool::Result<std::optional<Entry>> known(fabric::CallId call) const;
  /// The call's own attempt, or what became of an earlier one.
  sdk::Response first_attempt(Lock& lock, const Entry& entry);
  /// One attempt, with the lock let go meanwhile; the entry is what the spool holds afterwards.
  Outcome attempt(Lock& lock, const Entry& entry, bool program_waits);
  Outcome send(const Entry& entry);
  /// Both write to the spool without the lock and take it then.
  void keep(Lock& lock, const Entry& entry);
  void drop(Lock& lock, fabric::CallId call);
  /// With the lock: what is known of the entry without looking into the spool.
  void note(const Entry& entry);
  void tell(const Entry& entry, const Outcome& outcome) const;

  /// With the lock: tells what troubles it now.
  void tell_condition();
  /// The same, after the spool was used; `result` is what came of it.
  template <typename Value>
  void note_spool(const Spool::Result<Value>& result);

  void run(Lane lane);
  /// The call whose mail is due the longest, if it is time; otherwise `wake` is when to look again.
  std::optional<fabric::CallId> due(Lane lane, fabric::Time now, fabric::Time& wake) const;
  void try_again(Lock& lock, fabric::CallId call, fabric::Time now);
  /// What could not be written down.
  void write_again(Lock& lock);
  void forget_old(Lock& lock, fabric::Time now);
  bool believes_clock();

  Config config_;
  Spool spool_;
  Transport& transport_;
  base::program::Log log_;
  fabric::NoticeSink& notices_;
  Condition condition_;
  mutable std::mutex lock_;
  std::condition_variable changed_;
  /// The mails that wait, and when each is to be tried again.
  std::map<fabric::CallId, fabric::Time> waiting_;
  /// Those of them over which the server has let the time run out the last time.
  std::set<fabric::CallId> stalled_;
  /// What became of these could not be written to the spool, which says less than is known.
  std::map<fabric::CallId, Entry> unwritten_;
  /// Calls with an attempt under way.
  std::set<fabric::CallId> busy_;
  /// Old calls are forgotten by a clock that can be believed: a call that is forgotten and repeated
  /// sends a second mail.
  std::optional<base::loop::ClockWatch> clock_;
  /// No contact: nothing is tried again before.
  fabric::Time pause_until_{};
  /// When old calls are forgotten and what is not written down is.
  std::chrono::steady_clock::time_point next_tidying_{};
  bool stopping_ = false;
  std::thread thread_;
  std::thread stalled_thread_;
};

}  // namespace millrace::services::mail
