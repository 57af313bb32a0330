// Checks regularly which participants are revoked, whether the own certificate has expired, and
// whether this process needs a new participant. It has a thread, since Cyclone reads the CRL once
// and reports none of the others.
//
//   TrustWatch watch(trust, {.revoked = […](const auto& names) { return store.left_out_of(names); },
//                            .lost_on_one_side = […](auto now) { return loss.find(now, announced); },
//                            .log = […](std::string text) { … }});
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <tl/expected.hpp>

namespace millrace::fabric::dds {

// The credentials of a participant of a fabric with trust, and how it learns of revocations. Made
// by fabric/profile from the folder that `millrace trust issue` filled.

struct Trust {
  /// The name in its certificate.
  std::string name{};
  /// The partitions of its identity, which its permissions allow (fabric/participant_identity.hpp).
  std::vector<std::string> identity_partitions{};
  /// When its certificate expires: Cyclone then removes the participant without a report.
  std::chrono::sys_seconds until{};
  /// The names on the host's present CRL, or why it cannot be read. Called about once a second, in
  /// a thread of the participant.
  std::function<tl::expected<std::set<std::string>, std::string>()> revoked{};
  /// Its own certificate has expired or was revoked; called in that thread, repeatedly until the
  /// process has ended. May be empty.
  std::function<void(const std::string& reason)> ended{};
  /// This participant and another one can never authenticate each other again
  /// (fabric/one_sided_loss.hpp), or others have lost it while the host slept: only a new
  /// participant helps. Called in that thread, perhaps repeatedly. May be empty.
  std::function<void(const std::string& reason)> needs_new_participant{};
  /// How long a participant that was lost may take to authenticate itself again. A handshake takes
  /// a tenth of a second, hundreds at once much longer. Above each lease: an announcement that
  /// comes after the end of its participant makes DDS announce it for its lease.
  std::chrono::seconds patience{120};
  /// Not before the participant is as old as this: an insider can bring it about.
  std::chrono::seconds least_age{300};
};

class TrustWatch {
 public:
  struct Reported {
    /// Called with the names in the CRL at each check. Returns the names that an earlier CRL listed
    /// and this one does not.
    std::function<std::vector<std::string>(const std::set<std::string>&)> revoked;
    /// Called at each check. Returns the name of a participant that this one has lost alone.
    std::function<std::optional<std::string>(std::chrono::steady_clock::time_point)>
        lost_on_one_side;
    /// The time that the host has slept since its start, which the steady clock does not count.
    std::function<std::chrono::nanoseconds()> slept;
    /// A message for people, once.
    std::function<void(std::string)> log;
  };

  /// Checks once before it returns; from then on `report` is called in its thread. `lease`: after
  /// this time without a packet others take the participant for gone.
  TrustWatch(std::shared_ptr<const Trust> trust, std::chrono::milliseconds lease, Reported report);
  ~TrustWatch();
  TrustWatch(const TrustWatch&) = delete;
  TrustWatch& operator=(const TrustWatch&) = delete;

 private:
  void run();
  void update_trust();
  void check_own_certificate(std::chrono::steady_clock::time_point now);
  void check_participant(std::chrono::steady_clock::time_point now);
  /// Calls `callback`, or without one reports `reason` and `advice`.
  void report(const std::function<void(const std::string&)>& callback, const std::string& reason,
              const std::string& advice);

  const std::shared_ptr<const Trust> trust_;
  const std::chrono::milliseconds lease_;
  const Reported report_;
  /// The problem with the CRL that was reported last.
  std::string trouble_;
  bool own_revoked_ = false;
  /// When the expiry of our own certificate was reported last.
  std::optional<std::chrono::steady_clock::time_point> ended_at_;
  /// When the need of a new participant was reported last.
  std::optional<std::chrono::steady_clock::time_point> replaced_at_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  /// At the last check.
  std::chrono::nanoseconds slept_;

  std::mutex end_lock_;
  std::condition_variable end_news_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace millrace::fabric::dds
