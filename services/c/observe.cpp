// Lists of instances, and observers of calls and alarms.
#include <condition_variable>
#include <deque>
#include <mutex>

#include "fabric/channel_scope.hpp"
#include "fabric/observer/observer.hpp"
#include "fabric/words.hpp"
#include "services/c/participant.hpp"
#include "tools/bus/snapshot.hpp"

namespace millrace::services::c {

namespace {

std::string channels_text(const fabric::InstanceIdentity& identity) {
  std::string text;
  for (const fabric::ChannelScope& scope : identity.channels) {
    text += (text.empty() ? "" : " ") + fabric::format_channel_scope(scope);
  }
  return text;
}

/// An event and the texts that its millrace_event points to.
struct Event {
  std::string kind{};
  fabric::Time at{};
  std::uint64_t lost = 0;
  fabric::Event call{};
  std::string call_id{};
  std::string instance{};
  std::string detail{};
  std::string level{};
  fabric::Alarm alarm{};
};

Event event_of(const fabric::Event& call) {
  return {.kind = std::string(fabric::name_of(call.kind)),
          .at = call.at,
          .call = call,
          .call_id = call.call.to_string(),
          .instance = call.instance == fabric::InstanceId{} ? "" : call.instance.to_string(),
          .detail = call.detail};
}

Event event_of(const fabric::observer::AlarmNews& news) {
  return {.kind = news.over ? "alarm over" : "alarm",
          .at = news.over ? std::chrono::time_point_cast<fabric::Time::duration>(
                                std::chrono::system_clock::now())
                          : news.alarm.since,
          .instance = news.alarm.key.responder.to_string(),
          .detail = news.alarm.text,
          .level = std::string(fabric::name_of(news.alarm.level)),
          .alarm = news.alarm};
}

/// Adds events to a queue on the loop of the process; another thread takes them.
class Observing final : public fabric::observer::ObserverListener {
 public:
  Observing(Participant& participant, std::uint32_t what, std::size_t capacity)
      : capacity_(capacity) {
    using fabric::observer::Interest;
    sdk::SharedParticipant& shared = *participant.shared();
    if ((what & MILLRACE_OBSERVE_CALLS) != 0) {
      calls_.emplace(shared.participant(), shared.loop().get_executor(), *this, Interest::calls);
    }
    if ((what & MILLRACE_OBSERVE_ALARMS) != 0) {
      alarms_.emplace(shared.participant(), shared.loop().get_executor(), *this, Interest::alarms);
    }
  }

  std::optional<Event> next(std::optional<std::chrono::milliseconds> limit) {
    std::unique_lock guard(lock_);
    const auto something = [this] { return !waiting_.empty(); };
    if (!limit) {
      news_.wait(guard, something);
    } else if (!news_.wait_for(guard, *limit, something)) {
      return std::nullopt;
    }
    Event event = std::move(waiting_.front());
    waiting_.pop_front();
    return event;
  }

 private:
  void on_entry(fabric::observer::Entry entry) override {
    if (const auto* call = std::get_if<fabric::Event>(&entry.sample)) {
      add(event_of(*call));
    } else if (const auto* news = std::get_if<fabric::observer::AlarmNews>(&entry.sample)) {
      add(event_of(*news));
    }
  }

  void add(Event event) {
    const std::lock_guard guard(lock_);
    if (waiting_.size() >= capacity_) {
      ++lost_;
      return;
    }
    event.lost = std::exchange(lost_, 0);
    waiting_.push_back(std::move(event));
    news_.notify_one();
  }

  const std::size_t capacity_;
  std::mutex lock_;
  std::condition_variable news_;
  std::deque<Event> waiting_;
  std::uint64_t lost_ = 0;
  // Last: they call the functions above until they are destroyed.
  std::optional<fabric::observer::Observer> calls_;
  std::optional<fabric::observer::Observer> alarms_;
};

}  // namespace

}  // namespace millrace::services::c

namespace c = millrace::services::c;
namespace fabric = millrace::fabric;

struct millrace_instances {
  struct One {
    fabric::InstanceIdentity identity{};
    std::string id{};
    std::string channels{};
    millrace_instance view{};
  };
  // A deque: its elements keep their addresses.
  std::deque<One> all{};
};

millrace_code millrace_list(millrace_participant* participant, millrace_instances** instances) {
  return c::guarded([&] {
    c::checked(instances, "instances") = nullptr;
    const auto state = c::state_of(participant);
    state->check_discovers("millrace_list");
    const auto live = millrace::tools::bus::take_snapshot(state->join());
    auto list = std::make_unique<millrace_instances>();
    for (const auto& [id, instance] : live.instances()) {
      const fabric::InstanceStatus status = instance.status.value_or(fabric::InstanceStatus{});
      auto& observed = list->all.emplace_back(
          millrace_instances::One{.identity = instance.identity,
                                  .id = id.to_string(),
                                  .channels = c::channels_text(instance.identity)});
      observed.view = {
          .size = sizeof observed.view,
          .id = observed.id.c_str(),
          .uuid = observed.identity.uuid.c_str(),
          .name = observed.identity.name.c_str(),
          .description = observed.identity.description.c_str(),
          .version = observed.identity.version.c_str(),
          .host = observed.identity.host.c_str(),
          .pid = observed.identity.pid,
          .channels = observed.channels.c_str(),
          .delivery = observed.identity.delivery == fabric::Delivery::at_most_once
                          ? MILLRACE_AT_MOST_ONCE
                          : MILLRACE_AT_LEAST_ONCE,
          .completion = observed.identity.completion_signal == fabric::CompletionSignal::response
                            ? MILLRACE_RESPONSE
                            : MILLRACE_RESPONSE_STATE,
          .concurrent_calls = observed.identity.concurrency,
          .draining = observed.identity.draining ? 1 : 0,
          .certificate = observed.identity.certificate.c_str(),
          .running = status.running,
          .waiting = status.waiting,
          .answered = status.answered,
          .failed = status.failed,
          .mean_ns = status.mean.count()};
    }
    *instances = list.release();
  });
}

size_t millrace_instances_count(const millrace_instances* instances) {
  return instances != nullptr ? instances->all.size() : 0;
}

const millrace_instance* millrace_instances_at(const millrace_instances* instances, size_t index) {
  return index < millrace_instances_count(instances) ? &instances->all[index].view : nullptr;
}

void millrace_instances_free(millrace_instances* instances) {
  delete instances;
}

struct millrace_observer {
  std::shared_ptr<c::Participant> participant;
  std::unique_ptr<c::Observing> observing{};
  // The event that `view` points to.
  c::Event event{};
  millrace_event view{};
};

millrace_code millrace_observer_open(millrace_participant* participant,
                                     const millrace_observer_options* options,
                                     millrace_observer** observer) {
  return c::guarded([&] {
    constexpr std::uint32_t all = MILLRACE_OBSERVE_CALLS | MILLRACE_OBSERVE_ALARMS;
    c::checked(observer, "observer") = nullptr;
    const auto state = c::state_of(participant);
    const millrace_observer_options given =
        options == nullptr ? millrace_observer_options{}
                           : c::read_options(*options, "millrace_observer_options");
    state->check_discovers("millrace_observer_open");
    if ((given.what & ~all) != 0) {
      throw c::Error(MILLRACE_INVALID,
                     fmt::format("what is {}; expected 0 to {}", given.what, all));
    }
    auto handle = std::make_unique<millrace_observer>(millrace_observer{.participant = state});
    handle->observing = state->on_loop([&] {
      return std::make_unique<c::Observing>(*state, given.what == 0 ? all : given.what,
                                            given.capacity == 0 ? 65'536 : given.capacity);
    });
    *observer = handle.release();
  });
}

millrace_code millrace_observe(millrace_observer* observer, uint32_t timeout_ms,
                               const millrace_event** event) {
  return c::guarded([&]() -> millrace_code {
    c::checked(event, "event") = nullptr;
    c::check_process(c::checked(observer, "observer").participant->process());
    auto next = observer->observing->next(
        timeout_ms == MILLRACE_FOREVER ? std::nullopt
                                       : std::optional(std::chrono::milliseconds(timeout_ms)));
    if (!next) {
      return MILLRACE_NOTHING;
    }
    observer->event = std::move(*next);
    const c::Event& of = observer->event;
    observer->view = {.size = sizeof observer->view,
                      .kind = of.kind.c_str(),
                      .time_ns = of.at.time_since_epoch().count(),
                      .lost = of.lost,
                      .machine = of.call.key.machine.c_str(),
                      .channel = of.call.key.channel,
                      .call_id = of.call_id.c_str(),
                      .attempt = of.call.attempt,
                      .uuid = of.call.uuid.c_str(),
                      .text = of.call.text.c_str(),
                      .text_length = of.call.text.size(),
                      .state = of.call.state,
                      .replayed = of.call.replayed ? 1 : 0,
                      .instance = of.instance.c_str(),
                      .detail = of.detail.c_str(),
                      .level = of.level.c_str(),
                      .alarm = of.alarm.key.kind.c_str(),
                      .subject = of.alarm.key.subject.c_str(),
                      .remedy = of.alarm.advice.text.c_str(),
                      .process = of.alarm.program.c_str(),
                      .host = of.alarm.host.c_str(),
                      .pid = of.alarm.pid};
    *event = &observer->view;
    return MILLRACE_OK;
  });
}

void millrace_observer_free(millrace_observer* observer) {
  if (observer == nullptr || observer->participant->process() != ::getpid()) {
    return;
  }
  static_cast<void>(c::guarded([observer] {
    observer->participant->on_loop([observer] { observer->observing.reset(); });
    return MILLRACE_OK;
  }));
  delete observer;
}
