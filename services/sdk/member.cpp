#include "services/sdk/member.hpp"

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

#include "base/loop/watchdog.hpp"
#include "fabric/dds/badges.hpp"
#include "fabric/ends/beat_end.hpp"
#include "fabric/ends/instance_commands.hpp"
#include "fabric/registry/beats.hpp"

namespace millrace::services::sdk {

namespace asio = boost::asio;

namespace {

/// For `top -H`: of the threads of a service this is the one that keeps it on the fabric.
constexpr const char* loop_thread = "loop";
constexpr const char* stand_in_thread = "heartbeat";

/// A loop that has not beaten for so long does no work any more: its process is to be missed.
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

struct Member::Impl final : fabric::ends::InstanceCommandsListener {
  Impl(const fabric::dds::ParticipantOptions& join, std::shared_ptr<spdlog::logger> own_log)
      : log(std::move(own_log)), participant(join), beat_timer(context) {}

  ~Impl();
  void start();
  /// Publishes heartbeats and takes commands, which only a process with instances may do on a
  /// fabric with trust. On the loop, or before it runs.
  void host();
  void beat();
  /// Beats for the loop while it has other work.
  void stand_in();
  void send(const fabric::Beat& beat);
  [[nodiscard]] std::chrono::nanoseconds period() const {
    return std::chrono::nanoseconds(participant.options().lease) /
           fabric::ends::BeatEnd::beats_per_lease;
  }
  [[nodiscard]] std::optional<std::uint32_t> running(
      const fabric::InstanceId& instance) const override;
  void on_drain(const fabric::InstanceId& instance, const std::string& issuer) override;
  /// What is not believed.
  void tell_ignored();
  void on_untold(const fabric::Command& command, const std::string& reason) override;

  const std::shared_ptr<spdlog::logger> log;
  fabric::dds::Participant participant;
  std::optional<fabric::ends::BeatEnd> beat_end;
  asio::io_context context{1};
  asio::steady_timer beat_timer;
  /// The supervisor of a service looks whether this loop turns.
  const base::loop::Watchdog watchdog{context.get_executor()};
  std::optional<fabric::ends::InstanceCommands> commands;
  std::optional<fabric::dds::Badges::Watcher> badges;
  // On the loop only.
  std::map<fabric::InstanceId, Hosted*> hosted;
  const fabric::InstanceId member = fabric::InstanceId::random();
  fabric::registry::Beats beats{member};

  std::mutex beat_lock;
  std::condition_variable ends;
  bool ended = false;
  std::chrono::steady_clock::time_point loop_beat_at{};
  // Last: they use all of the above.
  std::thread thread;
  std::thread heartbeat;
};

Member::Impl::~Impl() {
  {
    const std::lock_guard guard(beat_lock);
    ended = true;
  }
  ends.notify_one();
  if (heartbeat.joinable()) {
    heartbeat.join();
  }
}

void Member::Impl::start() {
  if (participant.options().finding != fabric::dds::Finding::hears) {
    host();
  }
  if (participant.badges() != nullptr) {
    badges.emplace(*participant.badges(),
                   [this] { asio::post(context, [this] { tell_ignored(); }); });
  }
  thread = std::thread([this] {
    const auto work = asio::make_work_guard(context);
    context.run();
  });
  ::pthread_setname_np(thread.native_handle(), loop_thread);
}

void Member::Impl::host() {
  if (beat_end) {
    return;
  }
  beat_end.emplace(participant);
  commands.emplace(participant, context.get_executor(), *this);
  beat_timer.expires_after(std::chrono::nanoseconds(0));
  heartbeat = std::thread([this] { stand_in(); });
  ::pthread_setname_np(heartbeat.native_handle(), stand_in_thread);
  asio::post(context, [this] { beat(); });
}

void Member::Impl::beat() {
  for (const auto& [id, one] : hosted) {
    beats.note(one->load());
  }
  {
    const std::lock_guard guard(beat_lock);
    loop_beat_at = std::chrono::steady_clock::now();
  }
  send(beats.next(wall_time()));
  // Late ones are not made up for.
  beat_timer.expires_at(std::max(beat_timer.expiry() + period(), std::chrono::steady_clock::now()));
  beat_timer.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      beat();
    }
  });
}

void Member::Impl::send(const fabric::Beat& beat) {
  // A beat that is lost is followed by the next one.
  static_cast<void>(beat_end->publish(beat));
}

/// What the instances do only the loop knows, so that is left out.
void Member::Impl::stand_in() {
  std::unique_lock guard(beat_lock);
  loop_beat_at = std::chrono::steady_clock::now();
  while (!ended) {
    ends.wait_for(guard, period(), [this] { return ended; });
    const auto late = std::chrono::steady_clock::now() - loop_beat_at;
    if (!ended && late > period() * 3 / 2 && late < longest_busy) {
      guard.unlock();
      send({.member = member, .at = wall_time()});
      guard.lock();
    }
  }
}

std::optional<std::uint32_t> Member::Impl::running(const fabric::InstanceId& instance) const {
  const auto one = hosted.find(instance);
  return one == hosted.end() ? std::nullopt : std::optional(one->second->load().status.running);
}

void Member::Impl::on_drain(const fabric::InstanceId& instance, const std::string& issuer) {
  if (const auto one = hosted.find(instance); one != hosted.end()) {
    one->second->on_drain(issuer);
  }
}

void Member::Impl::tell_ignored() {
  static_cast<void>(badges->take());
  for (const std::string& line : participant.badges()->take_complaints()) {
    log->warn("{}", line);
  }
}

void Member::Impl::on_untold(const fabric::Command& command, const std::string& reason) {
  log->warn("{} is not told what came of its command: {}", command.issuer, reason);
}

Member::Member(const fabric::dds::ParticipantOptions& join, std::shared_ptr<spdlog::logger> log,
               fabric::dds::Finding finding)
    : impl_(std::make_unique<Impl>(with(join, finding), std::move(log))) {
  impl_->start();
}

Member::~Member() {
  impl_->context.stop();
  impl_->thread.join();
  impl_->badges.reset();
  // Without a thread that runs it, the end may go anywhere.
  impl_->commands.reset();
}

fabric::dds::Participant& Member::participant() {
  return impl_->participant;
}

asio::io_context& Member::loop() {
  return impl_->context;
}

void Member::enter(const fabric::InstanceId& id, Hosted& hosted) {
  if (impl_->participant.options().finding == fabric::dds::Finding::hears) {
    std::packaged_task<void()> host([impl = impl_.get()] { impl->host(); });
    asio::dispatch(impl_->context, [&host] { host(); });
    host.get_future().get();
  }
  asio::post(impl_->context,
             [impl = impl_.get(), id, &hosted] { impl->hosted.emplace(id, &hosted); });
}

void Member::drain(const fabric::InstanceId& id) {
  asio::post(impl_->context, [impl = impl_.get(), id] { impl->on_drain(id, {}); });
}

void Member::leave(const fabric::InstanceId& id, const std::function<void()>& last) {
  std::promise<void> done;
  asio::dispatch(impl_->context, [this, id, &last, &done] {
    impl_->hosted.erase(id);
    impl_->beats.forget(id);
    last();
    done.set_value();
  });
  done.get_future().wait();
}

}  // namespace millrace::services::sdk
