#include "services/sdk/notices.hpp"

#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <spdlog/spdlog.h>

#include "fabric/ends/notice_end.hpp"
#include "services/sdk/member.hpp"

namespace millrace::services::sdk {

namespace asio = boost::asio;

struct Notices::State {
  using Key = std::pair<std::string, std::string>;

  void tell(const fabric::Notice& notice);

  std::mutex lock;
  // With the lock.
  std::map<Key, fabric::Notice> raised;
  std::shared_ptr<Member> member;
  // On the member's loop only.
  std::optional<fabric::ends::NoticeEnd> end;
  std::shared_ptr<spdlog::logger> log;
  bool said_untold = false;
};

void Notices::State::tell(const fabric::Notice& notice) {
  if (!end) {
    return;
  }
  if (const auto told = end->raise(notice); !told && !std::exchange(said_untold, true)) {
    log->warn("nobody is told of its troubles: {}", told.error());
  }
}

Notices::Notices() : state_(std::make_shared<State>()) {}

Notices::~Notices() {
  leave();
}

void Notices::raise(const fabric::Notice& notice) {
  const std::lock_guard guard(state_->lock);
  auto& known = state_->raised[{notice.key.kind, notice.key.subject}];
  if (known == notice) {
    return;
  }
  known = notice;
  if (state_->member) {
    asio::post(state_->member->loop(), [state = state_, notice] { state->tell(notice); });
  }
}

void Notices::clear(const std::string& kind, const std::string& subject) {
  const std::lock_guard guard(state_->lock);
  if (state_->raised.erase({kind, subject}) == 0 || !state_->member) {
    return;
  }
  asio::post(state_->member->loop(), [state = state_, kind, subject] {
    if (state->end) {
      static_cast<void>(state->end->clear(kind, subject));
    }
  });
}

void Notices::join(const std::shared_ptr<Member>& member, const fabric::InstanceIdentity& who,
                   std::shared_ptr<spdlog::logger> log) {
  const std::lock_guard guard(state_->lock);
  state_->member = member;
  asio::post(
      member->loop(),
      [state = state_, &there = *member, log = std::move(log),
       teller = fabric::Notice{
           .key = {.responder = who.id}, .program = who.name, .host = who.host, .pid = who.pid}] {
        state->log = log;
        // It outlives what is posted to its loop: see leave().
        state->end.emplace(there.participant(), there.loop().get_executor(), teller);
        const std::lock_guard reading(state->lock);
        for (const auto& [key, notice] : state->raised) {
          state->tell(notice);
        }
      });
}

void Notices::leave() {
  std::unique_lock guard(state_->lock);
  const std::shared_ptr<Member> member = std::exchange(state_->member, nullptr);
  guard.unlock();
  if (!member) {
    return;
  }
  std::promise<void> done;
  asio::dispatch(member->loop(), [this, &done] {
    state_->end.reset();
    done.set_value();
  });
  done.get_future().wait();
}

}  // namespace millrace::services::sdk
