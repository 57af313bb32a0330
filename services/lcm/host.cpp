#include "services/lcm/host.hpp"

#include <atomic>
#include <map>
#include <mutex>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <spdlog/spdlog.h>

#include "base/program/barrier.hpp"
#include "base/program/supervisor.hpp"
#include "fabric/lcm/mirror.hpp"
#include "fabric/log_limiter.hpp"
#include "fabric/observer/observer.hpp"
#include "services/lcm/bridge.hpp"
#include "services/sdk/instance.hpp"

namespace millrace::services::lcm {

namespace asio = boost::asio;

namespace {

using fabric::CallId;
using CallPointer = std::shared_ptr<const sdk::Call>;

fabric::Moment now() {
  return {std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
}

fabric::Request request_of(const sdk::Call& call) {
  return {.key = call.channel(),
          .call = call.id(),
          .attempt = call.attempt(),
          .uuid = call.uuid(),
          .text = call.text(),
          .state = call.state(),
          .deadline = call.deadline(),
          .replayed = call.replayed()};
}

/// An LCM process as an instance on the fabric.
struct Hosted {
  // In this order: releasing a call answers it, which has no effect once the instance is gone.
  std::map<CallId, CallPointer> calls;
  std::unique_ptr<sdk::Instance> instance;
};

}  // namespace

/// Events of DDS arrive in its threads, messages of LCM on the loop; a lock keeps the order of the
/// decisions and of the messages on LCM. Instances begin and end on the loop, without the lock: a
/// destroyed instance waits for its pending events.
struct Host::Impl final : SocketListener {
  using Lock = std::unique_lock<std::mutex>;

  Impl(const Config& config, sdk::ServiceOptions own_base, base::program::Log own_log)
      : base(std::move(own_base)),
        log(std::move(own_log)),
        bridge(config.rules),
        socket(loop, config.network, *this),
        timer(loop) {}

  void on_packet(std::string_view channel, std::string_view bytes, Sender sender) override;
  void on_fragment(std::string_view channel, Sender sender) override;
  void on_foreign(Sender sender) override;

  void on_tick();
  void perform(Lock lock, const Actions& actions);
  void say(Level level, const std::string& text) const;
  void send(const Publish& publish);
  void open(const Register& action);
  void close(Registration number);
  void pass_on(Registration number, Hosted& hosted, const CallPointer& call);
  [[nodiscard]] CallPointer take(const Answer& answer);
  void stop();
  void tell();

  const sdk::ServiceOptions base;
  const base::program::Log log;
  std::mutex lock;
  // Need the lock:
  Bridge bridge;
  fabric::LogLimiter log_limiter;
  std::map<Registration, std::unique_ptr<Hosted>> hosted;
  // On the loop:
  asio::io_context loop{1};
  Socket socket;
  asio::steady_timer timer;
  bool stopping = false;
  std::size_t told = 0;
};

void Host::Impl::on_packet(std::string_view channel, std::string_view bytes, Sender sender) {
  Lock held(lock);
  const Actions actions = bridge.on_message(channel, bytes, sender, now());
  perform(std::move(held), actions);
}

void Host::Impl::on_fragment(std::string_view channel, Sender sender) {
  Lock held(lock);
  const Actions actions = bridge.on_fragment(channel, sender, now().steady);
  perform(std::move(held), actions);
}

void Host::Impl::on_foreign(Sender sender) {
  const Lock held(lock);
  const auto line = log_limiter.admit(
      "foreign", "",
      fmt::format("{} is not on this host; ignored, since the configuration has a ttl of 0",
                  sender.to_string()),
      now().steady);
  if (line) {
    log->warn(*line);
  }
}

void Host::Impl::on_tick() {
  Lock held(lock);
  std::vector<Registration> drained;
  for (const auto& [number, one] : hosted) {
    if (one->instance && one->instance->drained()) {
      drained.push_back(number);
    }
  }
  Actions actions = bridge.on_time(now().steady);
  for (const Registration number : drained) {
    for (Action& action : bridge.on_drained(number)) {
      actions.push_back(std::move(action));
    }
  }
  for (std::string& line : log_limiter.due(now().steady)) {
    actions.emplace_back(LogLine{Level::warn, std::move(line)});
  }
  perform(std::move(held), actions);
  tell();
  if (stopping && hosted.empty()) {
    loop.stop();
    return;
  }
  timer.expires_after(Bridge::tick);
  timer.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      on_tick();
    }
  });
}

void Host::Impl::perform(Lock held, const Actions& actions) {
  std::vector<CallPointer> calls(actions.size());
  for (std::size_t i = 0; i < actions.size(); ++i) {
    if (const auto* publish = std::get_if<Publish>(&actions[i])) {
      send(*publish);
    } else if (const auto* answer = std::get_if<Answer>(&actions[i])) {
      calls[i] = take(*answer);
    } else if (const auto* progress = std::get_if<Progress>(&actions[i])) {
      if (const auto one = hosted.find(progress->number); one != hosted.end()) {
        const auto call = one->second->calls.find(progress->call);
        calls[i] = call == one->second->calls.end() ? nullptr : call->second;
      }
    }
  }
  held.unlock();
  for (std::size_t i = 0; i < actions.size(); ++i) {
    if (const auto* answer = std::get_if<Answer>(&actions[i])) {
      if (calls[i] && answer->result) {
        calls[i]->answer(*answer->result);
      } else if (calls[i]) {
        calls[i]->fail(answer->result.error());
      }
    } else if (const auto* progress = std::get_if<Progress>(&actions[i])) {
      if (calls[i]) {
        calls[i]->interim(progress->response);
      }
    } else if (const auto* opened = std::get_if<Register>(&actions[i])) {
      open(*opened);
    } else if (const auto* closed = std::get_if<Unregister>(&actions[i])) {
      close(closed->number);
    } else if (const auto* drain = std::get_if<Drain>(&actions[i])) {
      const auto one = hosted.find(drain->number);
      if (one != hosted.end() && one->second->instance) {
        one->second->instance->drain();
      }
    } else if (const auto* said = std::get_if<LogLine>(&actions[i])) {
      say(said->level, said->text);
    }
  }
}

void Host::Impl::say(Level level, const std::string& text) const {
  log->log(level == Level::warn ? spdlog::level::warn : spdlog::level::info, "{}", text);
}

/// Needs the lock.
void Host::Impl::send(const Publish& publish) {
  if (const auto sent = socket.publish(publish.channel, publish.bytes); !sent) {
    if (const auto line = log_limiter.admit("lost", "", sent.error(), now().steady)) {
      log->warn(*line);
    }
  }
}

CallPointer Host::Impl::take(const Answer& answer) {
  const auto one = hosted.find(answer.number);
  if (one == hosted.end()) {
    return nullptr;
  }
  const auto node = one->second->calls.extract(answer.call);
  return node.empty() ? nullptr : node.mapped();
}

void Host::Impl::open(const Register& action) {
  if (stopping) {
    return;
  }
  const Announcement& as = action.announcement;
  sdk::ServiceOptions options = base;
  options.uuid = as.uuid;
  options.name = as.name;
  options.description = as.description;
  options.version = as.version;
  options.channels = as.channels;
  options.delivery = as.delivery;
  options.concurrency = as.concurrency;
  const Registration number = action.number;
  Hosted* const one = [&] {
    const Lock held(lock);
    return hosted.emplace(number, std::make_unique<Hosted>()).first->second.get();
  }();
  try {
    auto instance = std::make_unique<sdk::Instance>(
        options, log,
        sdk::InstanceCallbacks{
            .call = [this, number, one](const CallPointer& call) { pass_on(number, *one, call); },
            .cancelled =
                [this, number](CallId call) {
                  Lock held(lock);
                  const Actions actions = bridge.on_cancelled(number, call, now().steady);
                  perform(std::move(held), actions);
                },
            .draining =
                [this, number](const std::string& issuer) {
                  // This process's own shutdown does not concern the LCM processes.
                  if (!issuer.empty()) {
                    Lock held(lock);
                    const Actions actions = bridge.on_dismissed(number, now().steady);
                    perform(std::move(held), actions);
                  }
                }});
    const Lock held(lock);
    one->instance = std::move(instance);
  } catch (const std::exception& error) {
    close(number);
    Lock held(lock);
    const Actions actions = bridge.on_refused(number, error.what(), now().steady);
    perform(std::move(held), actions);
  }
}

/// Destroys in the order of Hosted.
void Host::Impl::close(Registration number) {
  const auto node = [&] {
    const Lock held(lock);
    return hosted.extract(number);
  }();
}

void Host::Impl::pass_on(Registration number, Hosted& one, const CallPointer& call) {
  Lock held(lock);
  one.calls.insert_or_assign(call->id(), call);
  Actions actions = bridge.on_call(number, request_of(*call), now().steady);
  if (call->cancelled()) {
    for (Action& action : bridge.on_cancelled(number, call->id(), now().steady)) {
      actions.push_back(std::move(action));
    }
  }
  perform(std::move(held), actions);
}

void Host::Impl::stop() {
  stopping = true;
  for (const auto& [number, one] : hosted) {
    if (one->instance) {
      one->instance->drain();
    }
  }
}

/// The supervisor shows the number.
void Host::Impl::tell() {
  if (hosted.size() != told) {
    told = hosted.size();
    base::program::notify_supervisor(fmt::format("STATUS=serves {} LCM programs", told));
  }
}

Host::Host(const Config& config, sdk::ServiceOptions base, base::program::Log log)
    : impl_(std::make_unique<Impl>(config, std::move(base), std::move(log))) {}

Host::~Host() = default;

void Host::run() {
  impl_->on_tick();
  impl_->loop.run();
}

void Host::stop() {
  asio::post(impl_->loop, [impl = impl_.get()] { impl->stop(); });
}

Socket& Host::socket() {
  return impl_->socket;
}

struct MirrorThread::Impl final : fabric::observer::ObserverListener {
  Impl(fabric::dds::Participant& participant, Mirror own_mirror, Socket& own_socket,
       base::program::Log own_log)
      : mirror(std::move(own_mirror)),
        socket(own_socket),
        log(std::move(own_log)),
        observer(participant, context.get_executor(), *this,
                 fabric::observer::Interest::everything),
        thread([this] { context.run(); }) {}

  ~Impl() override {
    context.stop();
    thread.join();
  }

  void on_entry(fabric::observer::Entry entry) override {
    base::program::contain("mirroring the fabric on LCM", [&] {
      if (mirror.without_text.contains(entry.uuid)) {
        fabric::observer::withhold_text(entry);
      }
      const auto message = fabric::lcm::mirrored(entry);
      if (!message) {
        return;
      }
      const auto now = std::chrono::steady_clock::now();
      if (const auto sent = socket.publish(message->channel, message->bytes); !sent) {
        if (const auto line = log_limiter.admit("mirror", "", sent.error(), now)) {
          log->warn(*line);
        }
      }
      for (const std::string& line : log_limiter.due(now)) {
        log->warn(line);
      }
    });
  }

  const Mirror mirror;
  Socket& socket;
  const base::program::Log log;
  fabric::LogLimiter log_limiter;
  boost::asio::io_context context{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work{
      context.get_executor()};
  fabric::observer::Observer observer;
  std::thread thread;
};

MirrorThread::MirrorThread(fabric::dds::Participant& participant, Mirror mirror, Socket& socket,
                           base::program::Log log)
    : impl_(std::make_unique<Impl>(participant, std::move(mirror), socket, std::move(log))) {}

MirrorThread::~MirrorThread() = default;

}  // namespace millrace::services::lcm
