// millrace-lcm: LCM processes as services of the fabric.
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "base/program/barrier.hpp"
#include "base/program/log.hpp"
#include "base/program/supervisor.hpp"
#include "fabric/lcm/mirror.hpp"
#include "fabric/log_limiter.hpp"
#include "fabric/observer/observer.hpp"
#include "services/lcm/bridge.hpp"
#include "services/lcm/config.hpp"
#include "services/lcm/socket.hpp"
#include "services/sdk/host_program.hpp"
#include "services/sdk/instance.hpp"
#include "services/sdk/stop_signals.hpp"

namespace millrace::services::lcm {

namespace {

namespace program = base::program;
using fabric::CallId;

fabric::Moment now() {
  return {std::chrono::steady_clock::now(), std::chrono::system_clock::now()};
}

/// The LCM processes on the fabric: carries out the decisions of the bridge.
///
/// Events of DDS arrive in its threads, messages of LCM on the loop; a lock keeps the order of the
/// decisions and of the messages on LCM. Instances begin and end on the loop, without the lock: a
/// destroyed instance waits for its pending events.
class Host final : SocketListener {
 public:
  /// `base`: the participant of all instances, and their version. Throws std::runtime_error if
  /// joining LCM's group fails.
  Host(const Config& config, sdk::ServiceOptions base, program::Log log);

  /// Call it once.
  void run();
  /// Takes no new call, and ends run() when the running calls are answered. From any thread.
  void stop();

  /// For other senders on LCM; from any thread.
  [[nodiscard]] Socket& socket() { return socket_; }

 private:
  using Lock = std::unique_lock<std::mutex>;
  using CallPointer = std::shared_ptr<const sdk::Call>;

  /// An LCM process as an instance on the fabric.
  struct Hosted {
    // In this order: releasing a call answers it, which has no effect once the instance is gone.
    std::map<fabric::CallId, CallPointer> calls;
    std::unique_ptr<sdk::Instance> instance;
  };

  void on_packet(std::string_view channel, std::string_view bytes, Sender sender) override;
  void on_fragment(std::string_view channel, Sender sender) override;
  void on_foreign(Sender sender) override;

  void on_tick();
  void perform(Lock held, const Actions& actions);
  void say(Level level, const std::string& text) const;
  void send(const Publish& publish);
  void open(const Register& action);
  void close(Registration number);
  void pass_on(Registration number, Hosted& hosted, const CallPointer& call);
  [[nodiscard]] CallPointer take(const Answer& answer);
  void drain_all();
  void tell();

  const sdk::ServiceOptions base_;
  const program::Log log_;
  std::mutex lock_;
  // Need the lock:
  Bridge bridge_;
  fabric::LogLimiter log_limiter_;
  std::map<Registration, std::unique_ptr<Hosted>> hosted_;
  // On the loop:
  boost::asio::io_context loop_{1};
  Socket socket_;
  boost::asio::steady_timer timer_;
  bool stopping_ = false;
  std::size_t reported_ = 0;
};

Host::Host(const Config& config, sdk::ServiceOptions base, program::Log log)
    : base_(std::move(base)),
      log_(std::move(log)),
      bridge_(config.rules),
      socket_(loop_, config.network, *this),
      timer_(loop_) {}

void Host::run() {
  on_tick();
  loop_.run();
}

void Host::stop() {
  boost::asio::post(loop_, [this] { drain_all(); });
}

void Host::on_packet(std::string_view channel, std::string_view bytes, Sender sender) {
  Lock held(lock_);
  const Actions actions = bridge_.on_message(channel, bytes, sender, now());
  perform(std::move(held), actions);
}

void Host::on_fragment(std::string_view channel, Sender sender) {
  Lock held(lock_);
  const Actions actions = bridge_.on_fragment(channel, sender, now().steady);
  perform(std::move(held), actions);
}

void Host::on_foreign(Sender sender) {
  const Lock held(lock_);
  const auto line = log_limiter_.admit(
      "foreign", "",
      fmt::format("{} is not on this host; ignored, since the configuration has a ttl of 0",
                  sender.to_string()),
      now().steady);
  if (line) {
    log_->warn(*line);
  }
}

void Host::on_tick() {
  Lock held(lock_);
  std::vector<Registration> drained;
  for (const auto& [number, hosted] : hosted_) {
    if (hosted->instance && hosted->instance->drained()) {
      drained.push_back(number);
    }
  }
  Actions actions = bridge_.on_time(now().steady);
  for (const Registration number : drained) {
    for (Action& action : bridge_.on_drained(number)) {
      actions.push_back(std::move(action));
    }
  }
  for (std::string& line : log_limiter_.due(now().steady)) {
    actions.emplace_back(LogLine{Level::warn, std::move(line)});
  }
  perform(std::move(held), actions);
  tell();
  if (stopping_ && hosted_.empty()) {
    loop_.stop();
    return;
  }
  timer_.expires_after(Bridge::tick);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      on_tick();
    }
  });
}

void Host::perform(Lock held, const Actions& actions) {
  std::vector<CallPointer> calls(actions.size());
  for (std::size_t i = 0; i < actions.size(); ++i) {
    if (const auto* publish = std::get_if<Publish>(&actions[i])) {
      send(*publish);
    } else if (const auto* answer = std::get_if<Answer>(&actions[i])) {
      calls[i] = take(*answer);
    } else if (const auto* progress = std::get_if<Progress>(&actions[i])) {
      if (const auto hosted = hosted_.find(progress->number); hosted != hosted_.end()) {
        const auto call = hosted->second->calls.find(progress->call);
        calls[i] = call == hosted->second->calls.end() ? nullptr : call->second;
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
      const auto hosted = hosted_.find(drain->number);
      if (hosted != hosted_.end() && hosted->second->instance) {
        hosted->second->instance->drain();
      }
    } else if (const auto* line = std::get_if<LogLine>(&actions[i])) {
      say(line->level, line->text);
    }
  }
}

void Host::say(Level level, const std::string& text) const {
  log_->log(level == Level::warn ? spdlog::level::warn : spdlog::level::info, "{}", text);
}

/// Needs the lock.
void Host::send(const Publish& publish) {
  if (const auto sent = socket_.publish(publish.channel, publish.bytes); !sent) {
    if (const auto line = log_limiter_.admit("lost", "", sent.error(), now().steady)) {
      log_->warn(*line);
    }
  }
}

Host::CallPointer Host::take(const Answer& answer) {
  const auto hosted = hosted_.find(answer.number);
  if (hosted == hosted_.end()) {
    return nullptr;
  }
  const auto node = hosted->second->calls.extract(answer.call);
  return node.empty() ? nullptr : node.mapped();
}

void Host::open(const Register& action) {
  if (stopping_) {
    return;
  }
  const Registration number = action.number;
  Hosted* const hosted = [&] {
    const Lock held(lock_);
    return hosted_.emplace(number, std::make_unique<Hosted>()).first->second.get();
  }();
  try {
    auto instance = std::make_unique<sdk::Instance>(
        sdk::options_of(action.announcement, base_), log_,
        sdk::InstanceCallbacks{
            .call = [this, number,
                     hosted](const CallPointer& call) { pass_on(number, *hosted, call); },
            .cancelled =
                [this, number](CallId call) {
                  Lock held(lock_);
                  const Actions actions = bridge_.on_cancelled(number, call, now().steady);
                  perform(std::move(held), actions);
                },
            .draining =
                [this, number](const std::string& issuer) {
                  // This process's own shutdown does not concern the LCM processes.
                  if (!issuer.empty()) {
                    Lock held(lock_);
                    const Actions actions = bridge_.on_dismissed(number, now().steady);
                    perform(std::move(held), actions);
                  }
                }});
    const Lock held(lock_);
    hosted->instance = std::move(instance);
  } catch (const std::exception& error) {
    close(number);
    Lock held(lock_);
    const Actions actions = bridge_.on_refused(number, error.what(), now().steady);
    perform(std::move(held), actions);
  }
}

/// Destroys in the order of Hosted.
void Host::close(Registration number) {
  const auto node = [&] {
    const Lock held(lock_);
    return hosted_.extract(number);
  }();
}

void Host::pass_on(Registration number, Hosted& hosted, const CallPointer& call) {
  Lock held(lock_);
  hosted.calls.insert_or_assign(call->id(), call);
  Actions actions = bridge_.on_call(number, call->request(), now().steady);
  if (call->cancelled()) {
    for (Action& action : bridge_.on_cancelled(number, call->id(), now().steady)) {
      actions.push_back(std::move(action));
    }
  }
  perform(std::move(held), actions);
}

void Host::drain_all() {
  stopping_ = true;
  for (const auto& [number, hosted] : hosted_) {
    if (hosted->instance) {
      hosted->instance->drain();
    }
  }
}

/// The supervisor shows the number.
void Host::tell() {
  if (hosted_.size() != reported_) {
    reported_ = hosted_.size();
    program::notify_supervisor(fmt::format("STATUS=serves {} LCM processes", reported_));
  }
}

/// Sends calls and events of the fabric on LCM as they happen, on its own thread.
class MirrorThread final : fabric::observer::ObserverListener {
 public:
  /// `participant` discovers all others (fabric::dds::Finding); that of the services only announces
  /// itself. It and `socket` must outlive this. Throws std::runtime_error with Cyclone's reason.
  MirrorThread(fabric::dds::Participant& participant, Mirror mirror, Socket& socket,
               program::Log log)
      : mirror_(std::move(mirror)),
        socket_(socket),
        log_(std::move(log)),
        observer_(participant, context_.get_executor(), *this,
                  fabric::observer::Interest::everything),
        thread_([this] { context_.run(); }) {}
  ~MirrorThread() override {
    context_.stop();
    thread_.join();
  }
  MirrorThread(const MirrorThread&) = delete;
  MirrorThread& operator=(const MirrorThread&) = delete;

 private:
  void on_entry(fabric::observer::Entry entry) override {
    program::contain("mirroring the fabric on LCM", [&] {
      if (mirror_.without_text.contains(entry.uuid)) {
        fabric::observer::withhold_text(entry);
      }
      const auto message = fabric::lcm::mirrored(entry);
      if (!message) {
        return;
      }
      const auto now = std::chrono::steady_clock::now();
      if (const auto sent = socket_.publish(message->channel, message->bytes); !sent) {
        if (const auto line = log_limiter_.admit("mirror", "", sent.error(), now)) {
          log_->warn(*line);
        }
      }
      for (const std::string& line : log_limiter_.due(now)) {
        log_->warn(line);
      }
    });
  }

  const Mirror mirror_;
  Socket& socket_;
  const program::Log log_;
  fabric::LogLimiter log_limiter_;
  boost::asio::io_context context_{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work_{
      context_.get_executor()};
  fabric::observer::Observer observer_;
  std::thread thread_;
};

Config configuration(const std::string& file) {
  return file.empty() ? Config{} : program::must(load(file));
}

std::string_view served_words(const Rules& rules) {
  return rules.any_uuid ? "any UUID that a process announces" : "the UUIDs named";
}

std::string checked(const std::string& file) {
  const Config config = configuration(file);
  return fmt::format("{}, {} services, serves {}{}", config.network.url,
                     config.rules.services.size(), served_words(config.rules),
                     config.mirror ? ", mirrors the fabric" : "");
}

int serve(int argc, char** argv) {
  std::string file;
  bool mirror = false;
  sdk::HostProgram lcm(
      "Connects LCM processes to the fabric as services", "lcm", [&](CLI::App& app) {
        app.add_option(
               "--config", file,
               "Group, services and mirror (lcm.textproto). Without it, every LCM process on "
               "udpm://239.255.76.67:7667 of this host")
            ->type_name("FILE");
        app.add_flag("--mirror", mirror, "Publish calls and events of the fabric on LCM");
      });
  return lcm.run(argc, argv, [&](const sdk::HostedProcess& process) {
    Config config = configuration(file);
    if (mirror && !config.mirror) {
      config.mirror.emplace();
    }
    fabric::dds::ParticipantOptions join = process.join;
    join.name = process.name;
    // Before the participant of the services: all participants of a process use the discovery of
    // the first.
    std::optional<fabric::dds::Participant> hearing;
    if (config.mirror) {
      hearing.emplace(join);
    }
    std::optional<Host> host;
    sdk::StopSignals signals(process.log);
    host.emplace(config, process.services(), process.log);
    std::optional<MirrorThread> shown;
    if (config.mirror) {
      shown.emplace(*hearing, *config.mirror, host->socket(), process.log);
    }
    signals.on_stop([&] { host->stop(); });
    program::ready(fmt::format("{} serves LCM processes of {} on domain {}", process.name,
                               config.network.url, join.domain));
    host->run();
    return program::exit_done;
  });
}

}  // namespace

}  // namespace millrace::services::lcm

int main(int argc, char** argv) {
  using namespace millrace::services::lcm;
  return program::asks_for_check(argc, argv) ? program::check(argc, argv, checked)
                                             : serve(argc, argv);
}
