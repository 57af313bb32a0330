#include "services/sdk/instance.hpp"

#include <optional>
#include <stdexcept>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include "base/posix/system.hpp"
#include "fabric/dds/made_id.hpp"
#include "fabric/dds/trust_watch.hpp"
#include "fabric/endpoints/command_endpoint.hpp"
#include "fabric/endpoints/liveness_monitor.hpp"
#include "fabric/endpoints/reply_endpoint.hpp"
#include "services/sdk/runner.hpp"
#include "services/sdk/shared_participant.hpp"

namespace millrace::services::sdk {

namespace asio = boost::asio;

namespace {

fabric::InstanceIdentity make_identity(const ServiceOptions& options,
                                       const fabric::dds::Participant& participant) {
  const std::chrono::milliseconds lease = participant.options().lease;
  return {
      .id = fabric::dds::make_id(participant),
      .uuid = fabric::canonical_uuid(options.uuid),
      .name = options.name,
      .description = options.description,
      .version = options.version,
      .host = base::posix::host_name(),
      .pid = static_cast<std::uint32_t>(::getpid()),
      .channels = options.channels,
      .delivery = options.delivery,
      .completion_signal = options.completion_signal,
      .concurrency = options.concurrency,
      .lease = lease * fabric::endpoints::HeartbeatEndpoint::idle_leases,
      .busy_lease = lease,
  };
}

/// Logs a summary of the calls now and then. On the participant's loop, where it may outlive its
/// instance for as long as a line is being written.
class Summaries : public std::enable_shared_from_this<Summaries> {
 public:
  Summaries(asio::io_context& loop, std::shared_ptr<const Runner> runner, Service::Log log,
            std::string uuid)
      : timer_(loop), runner_(std::move(runner)), log_(std::move(log)), uuid_(std::move(uuid)) {}

  void wait() {
    timer_.expires_after(pause);
    timer_.async_wait([self = weak_from_this()](const boost::system::error_code& error) {
      const auto alive = self.lock();
      if (!error && alive) {
        alive->tell();
        alive->wait();
      }
    });
  }

  /// Since the last one.
  void tell() {
    const auto now = std::chrono::steady_clock::now();
    const fabric::InstanceStatus status = runner_->load().status;
    const auto span = std::chrono::ceil<std::chrono::seconds>(now - reported_at_);
    if (const auto line = call_summary(reported_, status, span)) {
      log_->info("{}: {}", uuid_, *line);
    }
    reported_ = status;
    reported_at_ = now;
  }

 private:
  static constexpr std::chrono::minutes pause{1};

  asio::steady_timer timer_;
  std::shared_ptr<const Runner> runner_;
  Service::Log log_;
  std::string uuid_;
  fabric::InstanceStatus reported_;
  std::chrono::steady_clock::time_point reported_at_ = std::chrono::steady_clock::now();
};

}  // namespace

fabric::dds::ParticipantOptions join_options(const ServiceOptions& options) {
  return {.domain = options.domain,
          .fabric = options.fabric,
          .lease = options.lease,
          .name = options.name,
          .configuration = options.configuration,
          .trust = options.trust};
}

CallSchedulerOptions scheduler_options(const ServiceOptions& options,
                                       const fabric::InstanceId& instance,
                                       bool authenticated_requesters) {
  if (options.error_state == 0) {
    throw std::invalid_argument("the error state of a service must not be 0");
  }
  if (options.concurrency > max_concurrency) {
    throw std::invalid_argument(
        fmt::format("a service runs at most {} calls at once, not {}; start more instances of it",
                    max_concurrency, options.concurrency));
  }
  return {.instance = instance,
          .concurrency = options.concurrency,
          .delivery = options.delivery,
          .completion_signal = options.completion_signal,
          .error_state = options.error_state,
          .authenticated_requesters = authenticated_requesters};
}

struct Instance::Impl final : HostedInstance {
  Impl(const ServiceOptions& options, const Service::Log& own_log, InlineHandler inline_handler,
       std::function<void(const std::string& issuer)> report_draining = nullptr)
      : log(own_log),
        shared(options.participant
                   ? options.participant
                   : std::make_shared<SharedParticipant>(join_options(options), own_log)),
        identity(make_identity(options, shared->participant())),
        draining(std::move(report_draining)),
        runner(std::make_shared<Runner>(
            scheduler_options(options, identity.id,
                              shared->participant().authenticator() != nullptr),
            log, std::move(inline_handler),
            [participant = shared.get()] { participant->requested(); })),
        end(std::in_place, shared->participant(), shared->loop().get_executor(), identity, *runner,
            fabric::endpoints::Receiving::directly),
        summaries(std::make_shared<Summaries>(shared->loop(), runner, log, identity.uuid)),
        grace(shared->loop()) {}
  ~Impl() override { leave(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void start();
  void leave();
  [[nodiscard]] fabric::InstanceLoad load() const override;
  void on_drain(const std::string& issuer) override;

  const Service::Log log;
  const std::shared_ptr<SharedParticipant> shared;
  const fabric::InstanceIdentity identity;
  const std::function<void(const std::string& issuer)> draining;
  const std::shared_ptr<Runner> runner;
  std::optional<fabric::endpoints::ReplyEndpoint> end;
  /// On the participant's loop, both.
  std::shared_ptr<Summaries> summaries;
  asio::steady_timer grace;
  const fabric::Time started = std::chrono::system_clock::now();
  bool there = false;
};

void Instance::Impl::start() {
  runner->set_endpoint(&*end);
  shared->add_instance(identity.id, *this);
  asio::post(shared->loop(), [begun = summaries] { begun->wait(); });
  there = true;
}

void Instance::Impl::leave() {
  runner->close();
  if (std::exchange(there, false)) {
    shared->remove_instance(identity.id, [this] {
      grace.cancel();
      summaries->tell();
      summaries.reset();
      runner->set_endpoint(nullptr);
      end.reset();
    });
  }
}

void Instance::Impl::on_drain(const std::string& issuer) {
  if (!issuer.empty()) {
    log->info("{} commands this instance to leave", issuer);
  }
  if (draining) {
    draining(issuer);
  }
  end->set_draining(true);
  grace.expires_after(fabric::endpoints::InstanceCommands::drain_grace);
  grace.async_wait([runner = std::weak_ptr(runner)](const boost::system::error_code& error) {
    const auto alive = runner.lock();
    if (!error && alive) {
      alive->close_when_idle();
    }
  });
}

fabric::InstanceLoad Instance::Impl::load() const {
  fabric::InstanceLoad load = runner->load();
  load.status.started = started;
  return load;
}

Instance::Instance(const ServiceOptions& options, const Service::Log& log,
                   AsyncHandler inline_handler)
    : impl_(std::make_unique<Impl>(options, log,
                                   InlineHandler{.handler = std::move(inline_handler)})) {
  impl_->start();
}

Instance::Instance(const ServiceOptions& options, const Service::Log& log,
                   InstanceCallbacks callbacks)
    : impl_(std::make_unique<Impl>(options, log,
                                   InlineHandler{.handler = std::move(callbacks.call),
                                                 .forwards = true,
                                                 .cancelled = std::move(callbacks.cancelled)},
                                   std::move(callbacks.draining))) {
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
  impl_->shared->drain(impl_->identity.id);
}

std::optional<std::string> call_summary(const fabric::InstanceStatus& before,
                                        const fabric::InstanceStatus& now,
                                        std::chrono::seconds span) {
  const std::uint64_t answered = now.answered - before.answered;
  const std::uint64_t failed = now.failed - before.failed;
  const std::uint64_t repeated = now.repeated - before.repeated;
  const std::uint64_t cancelled = now.cancelled - before.cancelled;
  const std::uint64_t declined = now.declined - before.declined;
  if (answered + repeated + cancelled + declined == 0) {
    return std::nullopt;
  }
  std::string text = fmt::format("{} {} answered in {} s", answered,
                                 answered == 1 ? "call" : "calls", span.count());
  const auto add = [&](std::uint64_t count, const char* what) {
    if (count > 0) {
      text += fmt::format(", {} {}", count, what);
    }
  };
  add(failed, "with an error");
  add(repeated, "again from memory");
  add(cancelled, "withdrawn");
  add(declined, "declined");
  add(now.running, "still running");
  return text;
}

}  // namespace millrace::services::sdk
