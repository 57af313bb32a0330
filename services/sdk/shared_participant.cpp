#include "services/sdk/shared_participant.hpp"

#include <atomic>
#include <condition_variable>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include <boost/asio/dispatch.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include "base/loop/loop.hpp"
#include "fabric/dds/authenticator.hpp"
#include "fabric/endpoints/command_endpoint.hpp"
#include "fabric/endpoints/liveness_monitor.hpp"
#include "fabric/registry/heartbeats.hpp"

namespace millrace::services::sdk {

namespace asio = boost::asio;

namespace {

/// For `top -H`: the thread of a service that keeps it on the fabric.
constexpr const char* loop_thread = "loop";
constexpr const char* heartbeat_thread_name = "heartbeat";

/// How long a process sends heartbeats as a busy one after its last call: the next call often
/// follows soon.
constexpr std::chrono::seconds busy_after_call{1};

/// A loop without a heartbeat for this time does no work any more: its process must count as gone.
constexpr std::chrono::seconds longest_busy{5};

fabric::Time wall_time() {
  return std::chrono::time_point_cast<fabric::Time::duration>(std::chrono::system_clock::now());
}

fabric::dds::ParticipantOptions with(fabric::dds::ParticipantOptions join,
                                     fabric::dds::Finding finding) {
  join.finding = finding;
  return join;
}

}  // namespace

struct SharedParticipant::Impl final : fabric::endpoints::InstanceCommandsListener {
  Impl(const fabric::dds::ParticipantOptions& join, std::shared_ptr<spdlog::logger> own_log)
      : log(std::move(own_log)), participant(join), heartbeat_timer(context) {}

  ~Impl();
  void start();
  /// Publishes heartbeats and receives commands, which on a fabric with trust only a process with
  /// instances may do. On the loop, or before it runs.
  void host();
  void publish_heartbeat();
  void await_heartbeat(std::chrono::steady_clock::time_point at);
  void send_heartbeat_soon();
  /// Sends heartbeats for the loop while it has other work.
  void send_while_loop_is_busy();
  void send(const fabric::Heartbeat& heartbeat);
  [[nodiscard]] std::chrono::nanoseconds busy_period() const {
    return std::chrono::nanoseconds(participant.options().lease) /
           fabric::endpoints::HeartbeatEndpoint::heartbeats_per_lease;
  }
  [[nodiscard]] std::optional<std::uint32_t> running(
      const fabric::InstanceId& instance) const override;
  void on_drain(const fabric::InstanceId& instance, const std::string& issuer) override;
  /// Logs the rejected samples.
  void log_ignored();
  void on_unreported(const fabric::Command& command, const std::string& reason) override;

  const std::shared_ptr<spdlog::logger> log;
  fabric::dds::Participant participant;
  std::optional<fabric::endpoints::HeartbeatEndpoint> heartbeat_endpoint;
  asio::io_context context{1};
  asio::steady_timer heartbeat_timer;
  /// The supervisor of a service checks that this loop runs.
  const base::loop::Watchdog watchdog{context.get_executor()};
  std::optional<fabric::endpoints::InstanceCommands> commands;
  std::optional<fabric::dds::Authenticator::ChangeQueue> identity_changes;
  // On the loop only.
  std::map<fabric::InstanceId, HostedInstance*> hosted;
  const fabric::InstanceId process = fabric::InstanceId::random();
  fabric::registry::Heartbeats heartbeats{process};
  std::chrono::steady_clock::time_point busy_until{};
  /// No request has come since the last heartbeat; the next one is followed by a heartbeat soon.
  std::atomic<bool> unrequested = false;

  std::mutex heartbeat_lock;
  std::condition_variable changes;
  bool ended = false;
  std::chrono::steady_clock::time_point loop_heartbeat_at{};
  /// Between the loop's last heartbeat and its next one.
  std::chrono::nanoseconds period = busy_period();
  // Last: they use all of the above.
  std::thread thread;
  std::thread heartbeat_thread;
};

SharedParticipant::Impl::~Impl() {
  {
    const std::lock_guard guard(heartbeat_lock);
    ended = true;
  }
  changes.notify_one();
  if (heartbeat_thread.joinable()) {
    heartbeat_thread.join();
  }
}

void SharedParticipant::Impl::start() {
  if (participant.options().finding != fabric::dds::Finding::discovers) {
    host();
  }
  if (participant.authenticator() != nullptr) {
    identity_changes.emplace(*participant.authenticator(),
                             [this] { asio::post(context, [this] { log_ignored(); }); });
  }
  thread = std::thread([this] {
    const auto work = asio::make_work_guard(context);
    context.run();
  });
  ::pthread_setname_np(thread.native_handle(), loop_thread);
}

void SharedParticipant::Impl::host() {
  if (heartbeat_endpoint) {
    return;
  }
  heartbeat_endpoint.emplace(participant, process);
  commands.emplace(participant, context.get_executor(), *this);
  heartbeat_timer.expires_after(std::chrono::nanoseconds(0));
  heartbeat_thread = std::thread([this] { send_while_loop_is_busy(); });
  ::pthread_setname_np(heartbeat_thread.native_handle(), heartbeat_thread_name);
  asio::post(context, [this] { publish_heartbeat(); });
}

void SharedParticipant::Impl::publish_heartbeat() {
  const auto now = std::chrono::steady_clock::now();
  bool busy = !unrequested.exchange(true);
  for (const auto& [id, instance] : hosted) {
    const fabric::InstanceLoad load = instance->load();
    busy = busy || !load.calls.empty();
    heartbeats.note(load);
  }
  busy_until = busy ? now + busy_after_call : busy_until;
  const auto next = now < busy_until
                        ? busy_period()
                        : busy_period() * fabric::endpoints::HeartbeatEndpoint::idle_leases;
  {
    const std::lock_guard guard(heartbeat_lock);
    loop_heartbeat_at = now;
    period = next;
  }
  send(heartbeats.next(wall_time()));
  // Late heartbeats are not repeated.
  await_heartbeat(std::max(heartbeat_timer.expiry() + next, now));
}

void SharedParticipant::Impl::await_heartbeat(std::chrono::steady_clock::time_point at) {
  heartbeat_timer.expires_at(at);
  heartbeat_timer.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      publish_heartbeat();
    }
  });
}

void SharedParticipant::Impl::send_heartbeat_soon() {
  const auto soon = std::chrono::steady_clock::now() + busy_period();
  if (heartbeat_timer.expiry() <= soon) {
    return;
  }
  {
    const std::lock_guard guard(heartbeat_lock);
    loop_heartbeat_at = soon - busy_period();
    period = busy_period();
  }
  changes.notify_one();
  await_heartbeat(soon);
}

void SharedParticipant::Impl::send(const fabric::Heartbeat& heartbeat) {
  // A lost heartbeat is followed by the next one.
  static_cast<void>(heartbeat_endpoint->publish(heartbeat));
}

/// Only the loop knows the load of the instances, so the load is omitted.
void SharedParticipant::Impl::send_while_loop_is_busy() {
  std::unique_lock guard(heartbeat_lock);
  loop_heartbeat_at = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point checked_at{};
  while (!ended) {
    // An idle process wakes seldom.
    const auto patience = period > busy_period() ? period * 2 : period * 3 / 2;
    const auto due = std::max(loop_heartbeat_at + patience, checked_at + period);
    if (changes.wait_until(guard, due) == std::cv_status::no_timeout) {
      continue;
    }
    checked_at = std::chrono::steady_clock::now();
    const auto late = checked_at - loop_heartbeat_at;
    if (late >= patience && late < longest_busy) {
      guard.unlock();
      send({.process = process, .at = wall_time()});
      guard.lock();
    }
  }
}

std::optional<std::uint32_t> SharedParticipant::Impl::running(
    const fabric::InstanceId& instance) const {
  const auto found = hosted.find(instance);
  return found == hosted.end() ? std::nullopt : std::optional(found->second->load().status.running);
}

void SharedParticipant::Impl::on_drain(const fabric::InstanceId& instance,
                                       const std::string& issuer) {
  if (const auto found = hosted.find(instance); found != hosted.end()) {
    found->second->on_drain(issuer);
  }
}

void SharedParticipant::Impl::log_ignored() {
  static_cast<void>(identity_changes->take());
  for (const std::string& line : participant.authenticator()->take_warnings()) {
    log->warn("{}", line);
  }
}

void SharedParticipant::Impl::on_unreported(const fabric::Command& command,
                                            const std::string& reason) {
  log->warn("the outcome of a command of {} cannot be published: {}", command.issuer, reason);
}

SharedParticipant::SharedParticipant(const fabric::dds::ParticipantOptions& join,
                                     std::shared_ptr<spdlog::logger> log,
                                     fabric::dds::Finding finding)
    : impl_(std::make_unique<Impl>(with(join, finding), std::move(log))) {
  impl_->start();
}

SharedParticipant::~SharedParticipant() {
  impl_->context.stop();
  impl_->thread.join();
  impl_->identity_changes.reset();
  // Without a running loop, the endpoint may be destroyed in any thread.
  impl_->commands.reset();
}

fabric::dds::Participant& SharedParticipant::participant() {
  return impl_->participant;
}

asio::io_context& SharedParticipant::loop() {
  return impl_->context;
}

void SharedParticipant::add_instance(const fabric::InstanceId& id, HostedInstance& hosted) {
  if (impl_->participant.options().finding == fabric::dds::Finding::discovers) {
    std::packaged_task<void()> host([impl = impl_.get()] { impl->host(); });
    asio::dispatch(impl_->context, [&host] { host(); });
    host.get_future().get();
  }
  asio::post(impl_->context,
             [impl = impl_.get(), id, &hosted] { impl->hosted.emplace(id, &hosted); });
}

void SharedParticipant::requested() {
  // Many calls come between two heartbeats.
  if (impl_->unrequested.load(std::memory_order_relaxed) && impl_->unrequested.exchange(false)) {
    asio::post(impl_->context, [impl = impl_.get()] { impl->send_heartbeat_soon(); });
  }
}

void SharedParticipant::drain(const fabric::InstanceId& id) {
  asio::post(impl_->context, [impl = impl_.get(), id] { impl->on_drain(id, {}); });
}

void SharedParticipant::remove_instance(const fabric::InstanceId& id,
                                        const std::function<void()>& last) {
  std::promise<void> done;
  asio::dispatch(impl_->context, [this, id, &last, &done] {
    impl_->hosted.erase(id);
    impl_->heartbeats.forget(id);
    last();
    done.set_value();
  });
  done.get_future().wait();
}

}  // namespace millrace::services::sdk
