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

TrustWatch::TrustWatch(std::shared_ptr<const Trust> trust, std::chrono::milliseconds lease,
                       Reported report)
    : trust_(std::move(trust)), lease_(lease), report_(std::move(report)), slept_(report_.slept()) {
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
      check_participant(Clock::now());
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
    if (const auto missing = report_.revoked(*names); !missing.empty()) {
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
    report_.log(std::move(trouble));
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
  report(
      trust_->ended,
      over ? fmt::format("the certificate of {} expired on {:%F %R} UTC", trust_->name,
                         trust_->until)
           : fmt::format("the certificate of {} was revoked", trust_->name),
      "from now on no process on the fabric accepts what this one publishes; start it again with "
      "newer credentials");
}

void TrustWatch::check_participant(Clock::time_point now) {
  const auto slept = report_.slept();
  const bool was_lost = slept - std::exchange(slept_, slept) > lease_;
  const auto lost = report_.lost_on_one_side(now);
  if (replaced_at_ && (!trust_->needs_new_participant || now - *replaced_at_ < tell_again)) {
    return;
  }
  if (!was_lost && (!lost || now - begin_ < trust_->least_age)) {
    return;
  }
  replaced_at_ = now;
  report(trust_->needs_new_participant,
         was_lost
             ? std::string("the host slept, and the others have lost this process since")
             : fmt::format("the network to {} was down for so long that only this side lost the "
                           "other, and DDS Security never connects the two again",
                           *lost),
         "start this process again");
}

void TrustWatch::report(const std::function<void(const std::string&)>& callback,
                        const std::string& reason, const std::string& advice) {
  if (callback) {
    callback(reason);
    return;
  }
  // The process belongs to the user of the SDK and is not ended.
  report_.log(fmt::format("{}: {}", reason, advice));
}

}  // namespace millrace::fabric::dds
