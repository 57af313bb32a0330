#include "fabric/dds/trust_watch.hpp"

#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pthread.h>

#include "base/program/barrier.hpp"

namespace millrace::fabric::dds {

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// How soon a change of the CRL is seen.
constexpr auto look_every = 1s;
/// How often the end of the own certificate is reported again.
constexpr auto tell_again = 15s;

}  // namespace

TrustWatch::TrustWatch(std::shared_ptr<const Trust> trust, Reported told)
    : trust_(std::move(trust)), told_(std::move(told)) {
  update_trust();
  thread_ = std::thread([this] { run(); });
  ::pthread_setname_np(thread_.native_handle(), "trust");
}

TrustWatch::~TrustWatch() {
  {
    const std::lock_guard guard(end_lock_);
    ending_ = true;
  }
  end_news_.notify_all();
  thread_.join();
}

void TrustWatch::run() {
  std::unique_lock guard(end_lock_);
  while (!end_news_.wait_for(guard, look_every, [this] { return ending_; })) {
    guard.unlock();
    base::program::contain("checking certificates and the CRL", [this] {
      update_trust();
      check_own_certificate(Clock::now());
    });
    guard.lock();
  }
}

void TrustWatch::update_trust() {
  if (!trust_->revoked) {
    return;
  }
  const auto names = trust_->revoked();
  std::string trouble;
  if (names) {
    own_revoked_ = own_revoked_ || names->contains(trust_->name);
    if (const auto missing = told_.revoked(*names); !missing.empty()) {
      trouble = fmt::format(
          "the CRL (revoked.pem) does not list {} any more: an older CRL was copied over it. This "
          "process still rejects those participants; a process that starts now would accept them. "
          "Copy the newest CRL from the admin host",
          fmt::join(missing, ", "));
    }
  } else {
    trouble = names.error() +
              "; until then this process rejects the participants that the last readable CRL lists";
  }
  if (std::exchange(trouble_, trouble) != trouble && !trouble.empty()) {
    told_.said(std::move(trouble));
  }
}

void TrustWatch::check_own_certificate(Clock::time_point now) {
  if (ended_at_ && (!trust_->ended || now - *ended_at_ < tell_again)) {
    return;
  }
  const bool over = std::chrono::system_clock::now() >= trust_->until;
  if (!over && !own_revoked_) {
    return;
  }
  ended_at_ = now;
  const std::string reason = over ? fmt::format("the certificate of {} expired on {:%F %R} UTC",
                                                trust_->name, trust_->until)
                                  : fmt::format("the certificate of {} was revoked", trust_->name);
  if (trust_->ended) {
    trust_->ended(reason);
    return;
  }
  // The process belongs to the user of the SDK and is not ended.
  told_.said(reason +
             ": from now on no process on the fabric accepts what this one publishes; start it "
             "again with newer credentials");
}

}  // namespace millrace::fabric::dds
