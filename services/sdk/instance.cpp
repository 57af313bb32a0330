#include "services/sdk/instance.hpp"

#include <optional>
#include <stdexcept>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "base/loop/watchdog.hpp"
#include "base/posix/host.hpp"
#include "fabric/ends/instance_commands.hpp"
#include "fabric/ends/reply_end.hpp"
#include "services/sdk/runner.hpp"

namespace millrace::services::sdk {

namespace asio = boost::asio;

namespace {

/// Tools want to see load; nobody may be kept busy with it.
constexpr auto status_period = std::chrono::seconds(1);

fabric::InstanceIdentity make_identity(const ServiceOptions& options) {
  if (options.error_state == 0) {
    throw std::invalid_argument("the error state of a service must not be 0");
  }
  if (options.concurrency > max_concurrency) {
    throw std::invalid_argument(
        fmt::format("a service runs at most {} calls at once, not {}; start more instances of it",
                    max_concurrency, options.concurrency));
  }
  return {
      .id = fabric::InstanceId::random(),
      .uuid = fabric::canonical_uuid(options.uuid),
      .name = options.name,
      .description = options.description,
      .version = options.version,
      .host = base::posix::host_name(),
      .pid = static_cast<std::uint32_t>(::getpid()),
      .channels = options.channels,
      .delivery = options.delivery,
      .concurrency = options.concurrency,
  };
}

DeskOptions desk_options(const ServiceOptions& options, const fabric::InstanceIdentity& identity) {
  return {.instance = identity.id,
          .concurrency = options.concurrency,
          .delivery = options.delivery,
          .error_state = options.error_state};
}

}  // namespace

fabric::dds::ParticipantOptions join_options(const ServiceOptions& options) {
  return {.domain = options.domain,
          .fabric = options.fabric,
          .lease = options.lease,
          .name = options.name,
          .configuration = options.configuration};
}

struct Instance::Impl final : fabric::ends::InstanceCommandsListener {
  Impl(const ServiceOptions& options, Service::Log own_log, LaterHandler prompt)
      : log(std::move(own_log)),
        identity(make_identity(options)),
        participant(join_options(options)),
        runner(std::make_shared<Runner>(desk_options(options, identity), log,
                                        Prompt{std::move(prompt)})),
        grace(context),
        status_timer(context) {}
  /// Also where start() has failed half way.
  ~Impl() override { leave(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void start();
  void leave();
  void drain();
  void report();
  [[nodiscard]] std::optional<std::uint32_t> running(
      const fabric::InstanceId& instance) const override;
  void on_drain(const fabric::InstanceId& instance, const std::string& issuer) override;
  void on_untold(const fabric::Command& command, const std::string& reason) override;

  const Service::Log log;
  const fabric::InstanceIdentity identity;
  fabric::dds::Participant participant;
  std::shared_ptr<Runner> runner;
  asio::io_context context{1};
  asio::steady_timer grace;
  asio::steady_timer status_timer;
  /// The supervisor of a service looks whether this loop turns.
  const base::loop::Watchdog watchdog{context.get_executor()};
  std::optional<fabric::ends::ReplyEnd> end;
  std::optional<fabric::ends::InstanceCommands> commands;
  std::optional<fabric::InstanceStatus> reported;
  const fabric::Time started = std::chrono::system_clock::now();
  // Last: it uses all of the above.
  std::thread thread;
};

void Instance::Impl::start() {
  end.emplace(participant, identity, *runner);
  runner->set_end(&*end);
  commands.emplace(participant, context.get_executor(), *this);
  report();
  thread = std::thread([this] {
    const auto work = asio::make_work_guard(context);
    context.run();
  });
}

void Instance::Impl::leave() {
  runner->close();
  context.stop();
  if (thread.joinable()) {
    thread.join();
  }
  // Without a thread that runs it, the end may go anywhere.
  runner->set_end(nullptr);
  commands.reset();
  end.reset();
}

void Instance::Impl::drain() {
  end->set_draining(true);
  grace.expires_after(fabric::ends::InstanceCommands::drain_grace);
  grace.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      runner->close_when_idle();
    }
  });
}

void Instance::Impl::report() {
  fabric::InstanceStatus status = runner->status();
  status.started = started;
  if (status != reported) {
    // Lost status is no loss: the next one follows.
    static_cast<void>(end->publish(status));
    reported = status;
  }
  status_timer.expires_after(status_period);
  status_timer.async_wait([this](const boost::system::error_code& error) {
    if (!error) {
      report();
    }
  });
}

std::optional<std::uint32_t> Instance::Impl::running(const fabric::InstanceId& instance) const {
  return instance == identity.id ? std::optional(runner->status().running) : std::nullopt;
}

void Instance::Impl::on_drain(const fabric::InstanceId& /*instance*/, const std::string& issuer) {
  log->info("{} asks this instance to leave", issuer);
  drain();
}

void Instance::Impl::on_untold(const fabric::Command& command, const std::string& reason) {
  log->warn("{} is not told what came of its command: {}", command.issuer, reason);
}

Instance::Instance(const ServiceOptions& options, Service::Log log, LaterHandler prompt)
    : impl_(std::make_unique<Impl>(options, std::move(log), std::move(prompt))) {
  impl_->start();
}

Instance::~Instance() = default;

void Instance::leave() {
  impl_->leave();
}

const fabric::InstanceIdentity& Instance::identity() const {
  return impl_->identity;
}

std::shared_ptr<const Call> Instance::next() {
  return impl_->runner->next(std::chrono::steady_clock::time_point::max());
}

std::shared_ptr<const Call> Instance::next_for(std::chrono::milliseconds limit) {
  return impl_->runner->next(std::chrono::steady_clock::now() + limit);
}

bool Instance::drained() const {
  return impl_->runner->closed();
}

void Instance::drain() {
  asio::post(impl_->context, [impl = impl_.get()] { impl->drain(); });
}

}  // namespace millrace::services::sdk
