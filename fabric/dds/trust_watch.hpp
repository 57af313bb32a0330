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

#include "fabric/dds/trust.hpp"

namespace millrace::fabric::dds {

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
  void look_whom_to_believe();
  void look_at_our_own(std::chrono::steady_clock::time_point now);

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
