// Checks regularly which participants are revoked, and whether the own certificate has expired. It
// has a thread, since Cyclone reads the CRL once and does not report expiry.
//
//   TrustWatch watch(trust, {.revoked = […](const auto& names) { return store.left_out_of(names); },
//                            .said = […](std::string text) { … }});
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
};

class TrustWatch {
 public:
  struct Reported {
    /// Called with the names in the CRL at each check. Returns the names that an earlier CRL listed
    /// and this one does not.
    std::function<std::vector<std::string>(const std::set<std::string>&)> revoked;
    /// A message for people, once.
    std::function<void(std::string)> said;
  };

  /// Checks once before it returns; from then on `told` is called in its thread.
  TrustWatch(std::shared_ptr<const Trust> trust, Reported told);
  ~TrustWatch();
  TrustWatch(const TrustWatch&) = delete;
  TrustWatch& operator=(const TrustWatch&) = delete;

 private:
  void run();
  void update_trust();
  void check_own_certificate(std::chrono::steady_clock::time_point now);

  const std::shared_ptr<const Trust> trust_;
  const Reported told_;
  /// The problem with the CRL that was reported last.
  std::string trouble_;
  bool own_revoked_ = false;
  /// When the expiry of our own certificate was reported last.
  std::optional<std::chrono::steady_clock::time_point> ended_at_;

  std::mutex end_lock_;
  std::condition_variable end_news_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace millrace::fabric::dds
