#include "services/sdk/testing/loopback.hpp"

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "base/program/log.hpp"
#include "services/sdk/instance.hpp"
#include "services/sdk/runner.hpp"
#include "services/sdk/testing/request.hpp"

namespace millrace::services::sdk::testing {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds pause_after_decline{10};
/// A call waits for the end of a cancelled run, which is not reported, or for that pause.
constexpr std::chrono::milliseconds retry_period{1};

bool serves(const ServiceOptions& options, const fabric::Request& request) {
  const auto covers = [&](const fabric::ChannelScope& scope) {
    return (scope.machine.empty() || scope.machine == request.key.machine) &&
           (scope.channel == 0 || scope.channel == request.key.channel);
  };
  return fabric::canonical_uuid(options.uuid) == fabric::canonical_uuid(request.uuid) &&
         (options.channels.empty() || std::ranges::any_of(options.channels, covers));
}

}  // namespace

struct Pending::State {
  enum class Phase : std::uint8_t { waiting, running, answered, blocked, withdrawn };

  [[nodiscard]] bool open() const {
    return phase == Phase::waiting || phase == Phase::running || phase == Phase::blocked;
  }

  std::shared_ptr<Loopback::Impl> loopback;
  /// Its newest attempt.
  fabric::Request request;
  // Under the lock of the loopback.
  Phase phase = Phase::waiting;
  std::optional<std::size_t> instance;
  /// By the number of the instance: until when it is skipped.
  std::map<std::size_t, Clock::time_point> declined;
  std::vector<Response> interims;
  std::optional<fabric::Reply> reply;
  std::size_t replies = 0;
};

// Locks are taken in this order: `dispatching`, that of a runner, `lock`. A runner publishes under
// its own lock.
struct Loopback::Impl {
  struct Instance final : fabric::endpoints::ReplyPublisher {
    Instance(Impl& own_loopback, std::size_t own_number, ServiceOptions own_options)
        : loopback(own_loopback),
          number(own_number),
          options(std::move(own_options)),
          runner(std::make_shared<Runner>(scheduler_options(options, id, false),
                                          base::program::no_log(), InlineHandler{})) {
      runner->set_endpoint(this);
    }
    ~Instance() override {
      runner->close();
      runner->set_endpoint(nullptr);
    }
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    tl::expected<void, std::string> publish(const fabric::Reply& reply) override {
      loopback.on_reply(*this, reply);
      return {};
    }
    [[nodiscard]] std::size_t calls() const {
      const fabric::InstanceStatus status = runner->load().status;
      return status.running + status.waiting;
    }

    Impl& loopback;
    const std::size_t number;
    const ServiceOptions options;
    const fabric::InstanceId id = fabric::InstanceId::random();
    const std::shared_ptr<Runner> runner;
    /// Under the lock of the loopback.
    bool alive = true;
    /// The requests that it has and has not answered. Under the lock of the loopback.
    std::map<fabric::CallId, fabric::Request> requests;
    std::vector<std::jthread> workers;
  };

  Impl();
  ~Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  using Phase = Pending::State::Phase;
  using Calls = std::vector<std::shared_ptr<Pending::State>>;

  std::size_t start(const ServiceOptions& options, const AsyncHandler& handler);
  void kill(std::size_t number);
  std::shared_ptr<Pending::State> send(fabric::Request request);
  void withdraw(Pending::State& pending);
  void repeat(Pending::State& pending);
  void end();
  void on_reply(Instance& from, const fabric::Reply& reply);

  void retry(const std::stop_token& stop);
  /// The caller has locked `dispatching`.
  void dispatch();
  void withdraw_locked(Pending::State& pending);
  [[nodiscard]] Instance* choose(const Pending::State& pending);

  std::mutex dispatching;
  std::mutex lock;
  std::condition_variable_any changed;
  /// Changed under both locks.
  std::vector<std::unique_ptr<Instance>> instances;
  // Under `lock`.
  std::map<fabric::CallId, std::shared_ptr<Pending::State>> calls;
  std::map<fabric::ChannelKey, std::shared_ptr<Pending::State>> channels;
  /// The calls that wait for an instance.
  Calls waiting;
  bool progress = false;
  std::uint64_t next_number = 1;

  std::jthread retries;
};

Loopback::Impl::Impl() : retries([this](const std::stop_token& stop) { retry(stop); }) {}

std::size_t Loopback::Impl::start(const ServiceOptions& options, const AsyncHandler& handler) {
  const std::lock_guard dispatch_lock(dispatching);
  const std::size_t number = instances.size();
  auto instance = std::make_unique<Instance>(*this, number, options);
  for (std::uint32_t i = 0; i < options.concurrency; ++i) {
    instance->workers.emplace_back([runner = instance->runner, handler = guarded(handler)] {
      while (const auto call = runner->next(Clock::time_point::max())) {
        handler(call);
      }
    });
  }
  {
    const std::lock_guard guard(lock);
    instances.push_back(std::move(instance));
  }
  dispatch();
  return number;
}

void Loopback::Impl::kill(std::size_t number) {
  const std::lock_guard dispatch_lock(dispatching);
  Instance& instance = *instances.at(number);
  {
    const std::lock_guard guard(lock);
    if (!std::exchange(instance.alive, false)) {
      return;
    }
    for (const auto& [call, request] : instance.requests) {
      const auto& pending = calls.at(call);
      if (pending->phase == Phase::running && pending->instance == number) {
        const bool again = instance.options.delivery == fabric::Delivery::at_least_once;
        pending->phase = again ? Phase::waiting : Phase::blocked;
        if (again) {
          waiting.push_back(pending);
        }
      }
    }
    changed.notify_all();
  }
  instance.runner->close();
  dispatch();
}

std::shared_ptr<Pending::State> Loopback::Impl::send(fabric::Request request) {
  const std::lock_guard dispatch_lock(dispatching);
  const bool own_channel = request.key == fabric::ChannelKey{};
  auto pending = std::make_shared<Pending::State>();
  pending->request = complete(std::move(request));
  pending->request.attempt = 0;
  pending->request.requester = 0;
  pending->request.succeeds = 0;
  pending->request.may_wait = false;
  std::shared_ptr<Pending::State> earlier;
  {
    const std::lock_guard guard(lock);
    const std::uint64_t number = next_number++;
    pending->request.call.number = number;
    if (own_channel) {
      pending->request.key = {.machine = "loopback",
                              .channel = static_cast<std::uint16_t>((number - 1) % 65'535 + 1)};
    }
    earlier = std::exchange(channels[pending->request.key], pending);
    calls.emplace(pending->request.call, pending);
    waiting.push_back(pending);
    changed.notify_all();
  }
  if (earlier != nullptr) {
    withdraw_locked(*earlier);
  }
  dispatch();
  return pending;
}

void Loopback::Impl::withdraw(Pending::State& pending) {
  const std::lock_guard dispatch_lock(dispatching);
  withdraw_locked(pending);
}

void Loopback::Impl::withdraw_locked(Pending::State& pending) {
  Instance* instance = nullptr;
  {
    const std::lock_guard guard(lock);
    if (!pending.open()) {
      return;
    }
    if (pending.phase == Phase::running) {
      instance = instances[*pending.instance].get();
      instance->requests.erase(pending.request.call);
    }
    pending.phase = Phase::withdrawn;
    std::erase_if(waiting, [&](const auto& waiter) { return waiter.get() == &pending; });
    changed.notify_all();
  }
  if (instance != nullptr) {
    instance->runner->on_withdrawn(key_of(pending.request));
  }
}

void Loopback::Impl::repeat(Pending::State& pending) {
  const std::lock_guard dispatch_lock(dispatching);
  Instance* instance = nullptr;
  {
    const std::lock_guard guard(lock);
    if (pending.phase != Phase::running && pending.phase != Phase::answered) {
      return;
    }
    instance = instances[*pending.instance].get();
    if (!instance->alive) {
      return;
    }
    instance->requests.insert_or_assign(pending.request.call, pending.request);
  }
  instance->runner->on_request(pending.request);
}

void Loopback::Impl::end() {
  retries.request_stop();
  retries = {};
  std::vector<std::pair<Instance*, fabric::RequestKey>> under_way;
  {
    const std::lock_guard dispatch_lock(dispatching);
    {
      const std::lock_guard guard(lock);
      for (const auto& instance : instances) {
        instance->alive = false;
        for (const auto& [call, request] : instance->requests) {
          under_way.emplace_back(instance.get(), key_of(request));
        }
      }
      for (const auto& [call, pending] : calls) {
        pending->phase = pending->open() ? Phase::withdrawn : pending->phase;
      }
      changed.notify_all();
    }
    for (const auto& [instance, key] : under_way) {
      instance->runner->on_withdrawn(key);
    }
    for (const auto& instance : instances) {
      instance->runner->close();
    }
  }
  for (const auto& instance : instances) {
    instance->workers.clear();
    instance->runner->set_endpoint(nullptr);
  }
  const std::lock_guard guard(lock);
  waiting.clear();
  channels.clear();
  calls.clear();
}

void Loopback::Impl::on_reply(Instance& from, const fabric::Reply& reply) {
  const std::lock_guard guard(lock);
  const auto found = calls.find(reply.call);
  if (reply.kind != fabric::ReplyKind::interim) {
    from.requests.erase(reply.call);
    progress = true;
    changed.notify_all();
  }
  if (!from.alive || found == calls.end()) {
    return;
  }
  const std::shared_ptr<Pending::State>& pending = found->second;
  const bool current = pending->instance == from.number &&
                       pending->request.attempt == reply.attempt &&
                       (pending->phase == Phase::running || pending->phase == Phase::answered);
  if (!current) {
    return;
  }
  switch (reply.kind) {
    case fabric::ReplyKind::interim:
      pending->interims.push_back({.text = reply.text, .state = reply.state});
      break;
    case fabric::ReplyKind::declined:
      if (pending->phase == Phase::running) {
        pending->phase = Phase::waiting;
        pending->declined[from.number] = Clock::now() + pause_after_decline;
        waiting.push_back(pending);
      }
      break;
    case fabric::ReplyKind::final:
      pending->phase = Phase::answered;
      pending->reply = reply;
      ++pending->replies;
      break;
  }
}

void Loopback::Impl::retry(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    {
      std::unique_lock guard(lock);
      changed.wait(guard, stop, [this] { return !waiting.empty(); });
    }
    {
      const std::lock_guard dispatch_lock(dispatching);
      dispatch();
    }
    std::unique_lock guard(lock);
    changed.wait_for(guard, stop, retry_period, [this] { return std::exchange(progress, false); });
  }
}

void Loopback::Impl::dispatch() {
  Calls candidates;
  {
    const std::lock_guard guard(lock);
    candidates = waiting;
  }
  for (const auto& pending : candidates) {
    Instance* const instance = choose(*pending);
    if (instance == nullptr) {
      continue;
    }
    {
      const std::lock_guard guard(lock);
      std::erase(waiting, pending);
      pending->phase = Phase::running;
      pending->instance = instance->number;
      ++pending->request.attempt;
      pending->request.assigned = instance->id;
      instance->requests.insert_or_assign(pending->request.call, pending->request);
    }
    instance->runner->on_request(pending->request);
  }
}

Loopback::Impl::Instance* Loopback::Impl::choose(const Pending::State& pending) {
  std::map<std::size_t, Clock::time_point> declined;
  {
    const std::lock_guard guard(lock);
    declined = pending.declined;
  }
  const auto now = Clock::now();
  Instance* best = nullptr;
  std::size_t fewest = 0;
  for (const auto& instance : instances) {
    const auto skipped = declined.find(instance->number);
    if (!instance->alive || !serves(instance->options, pending.request) ||
        (skipped != declined.end() && now < skipped->second)) {
      continue;
    }
    const std::size_t calls_there = instance->calls();
    if (calls_there < instance->options.concurrency && (best == nullptr || calls_there < fewest)) {
      best = instance.get();
      fewest = calls_there;
    }
  }
  return best;
}

std::optional<fabric::Reply> Pending::wait(std::chrono::milliseconds limit) const {
  std::unique_lock guard(state_->loopback->lock);
  state_->loopback->changed.wait_for(guard, limit, [this] {
    return state_->phase != State::Phase::waiting && state_->phase != State::Phase::running;
  });
  return state_->phase == State::Phase::answered ? state_->reply : std::nullopt;
}

std::uint32_t Pending::attempt() const {
  const std::lock_guard guard(state_->loopback->lock);
  return state_->request.attempt;
}

std::optional<std::size_t> Pending::instance() const {
  const std::lock_guard guard(state_->loopback->lock);
  return state_->instance;
}

bool Pending::blocked() const {
  const std::lock_guard guard(state_->loopback->lock);
  return state_->phase == State::Phase::blocked;
}

std::vector<Response> Pending::interims() const {
  const std::lock_guard guard(state_->loopback->lock);
  return state_->interims;
}

std::size_t Pending::replies() const {
  const std::lock_guard guard(state_->loopback->lock);
  return state_->replies;
}

void Pending::withdraw() {
  state_->loopback->withdraw(*state_);
}

void Pending::repeat() {
  state_->loopback->repeat(*state_);
}

Loopback::Loopback() : impl_(std::make_shared<Impl>()) {}

Loopback::~Loopback() {
  impl_->end();
}

std::size_t Loopback::start(const ServiceOptions& options, Handler handler) {
  return start(options, as_async(std::move(handler)));
}

std::size_t Loopback::start(const ServiceOptions& options, const AsyncHandler& handler) {
  return impl_->start(options, handler);
}

void Loopback::kill(std::size_t instance) {
  impl_->kill(instance);
}

Pending Loopback::send(fabric::Request request) {
  auto state = impl_->send(std::move(request));
  state->loopback = impl_;
  return Pending(std::move(state));
}

}  // namespace millrace::services::sdk::testing
