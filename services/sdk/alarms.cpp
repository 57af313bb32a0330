#include "services/sdk/alarms.hpp"

#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include <boost/asio/dispatch.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <spdlog/spdlog.h>

#include "fabric/endpoints/alarm_endpoint.hpp"
#include "services/sdk/shared_participant.hpp"

namespace millrace::services::sdk {

namespace asio = boost::asio;

struct Alarms::State {
  using Key = std::pair<std::string, std::string>;

  void tell(const fabric::Alarm& alarm);

  std::mutex lock;
  // With the lock.
  std::map<Key, fabric::Alarm> raised;
  std::shared_ptr<SharedParticipant> shared;
  // On the participant's loop only.
  std::optional<fabric::endpoints::AlarmEndpoint> end;
  std::shared_ptr<spdlog::logger> log;
  bool logged_unreported = false;
};

void Alarms::State::tell(const fabric::Alarm& alarm) {
  if (!end) {
    return;
  }
  if (const auto published = end->raise(alarm);
      !published && !std::exchange(logged_unreported, true)) {
    log->warn("its alarms cannot be published: {}", published.error());
  }
}

Alarms::Alarms() : state_(std::make_shared<State>()) {}

Alarms::~Alarms() {
  leave();
}

void Alarms::raise(const fabric::Alarm& alarm) {
  const std::lock_guard guard(state_->lock);
  auto& known = state_->raised[{alarm.key.kind, alarm.key.subject}];
  if (known == alarm) {
    return;
  }
  known = alarm;
  if (state_->shared) {
    asio::post(state_->shared->loop(), [state = state_, alarm] { state->tell(alarm); });
  }
}

void Alarms::clear(const std::string& kind, const std::string& subject) {
  const std::lock_guard guard(state_->lock);
  if (state_->raised.erase({kind, subject}) == 0 || !state_->shared) {
    return;
  }
  asio::post(state_->shared->loop(), [state = state_, kind, subject] {
    if (state->end) {
      static_cast<void>(state->end->clear(kind, subject));
    }
  });
}

void Alarms::join(const std::shared_ptr<SharedParticipant>& shared,
                  const fabric::InstanceIdentity& who, std::shared_ptr<spdlog::logger> log) {
  const std::lock_guard guard(state_->lock);
  state_->shared = shared;
  asio::post(
      shared->loop(),
      [state = state_, &there = *shared, log = std::move(log),
       teller = fabric::Alarm{
           .key = {.responder = who.id}, .program = who.name, .host = who.host, .pid = who.pid}] {
        state->log = log;
        // It outlives the work that is posted to its loop: see leave().
        state->end.emplace(there.participant(), there.loop().get_executor(), teller);
        const std::lock_guard reading(state->lock);
        for (const auto& [key, alarm] : state->raised) {
          state->tell(alarm);
        }
      });
}

void Alarms::leave() {
  std::unique_lock guard(state_->lock);
  const std::shared_ptr<SharedParticipant> shared = std::exchange(state_->shared, nullptr);
  guard.unlock();
  if (!shared) {
    return;
  }
  std::promise<void> done;
  asio::dispatch(shared->loop(), [this, &done] {
    state_->end.reset();
    done.set_value();
  });
  done.get_future().wait();
}

}  // namespace millrace::services::sdk
