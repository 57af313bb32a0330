#include "gateway/shell/gateway.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <unistd.h>

#include "base/posix/host.hpp"
#include "fabric/channel_scope.hpp"
#include "gateway/shell/certificate_notices.hpp"
#include "gateway/shell/gateway_impl.hpp"

namespace millrace::gateway::shell {

namespace {

namespace asio = boost::asio;

core::GatewayIdentity identity_of(const journal::Journal& journal) {
  return {fabric::InstanceId::random(), base::posix::host_name(),
          static_cast<std::uint32_t>(::getpid()), MILLRACE_VERSION,
          journal.state().numbers().epoch};
}

std::unique_ptr<journal::Journal> open_journal(const asio::any_io_executor& executor,
                                               const settings::Settings& settings,
                                               const base::program::Log& logger) {
  if (!settings.journal.folder.empty()) {
    return journal::open_file(executor, settings.journal, logger);
  }
  logger->info(
      "no journal (--journal DIR): if this gateway ends while it writes an answer, that program "
      "waits on, and a call under way is given out again under a new id");
  return journal::in_memory(executor);
}

}  // namespace

Gateway::Impl::Impl(const asio::any_io_executor& the_executor, SpinAfterPublish& the_spin,
                    settings::Settings the_settings, base::program::Log the_log)
    : executor(the_executor),
      spin(the_spin),
      logger(std::move(the_log)),
      settings(std::move(the_settings)),
      journal(open_journal(executor, settings, logger)),
      timer(executor),
      heartbeat_timer(executor),
      load_timer(executor),
      certificate_timer(executor),
      own(identity_of(*journal)),
      participant(settings.join),
      call_end(participant, executor, *this),
      command_end(participant, executor, *this),
      notices(
          participant, executor,
          {.key = {.responder = own.id}, .program = "gateway", .host = own.host, .pid = own.pid}),
      watch(participant, executor, *this),
      core(*this, *this,
           {.own = own,
            .lease = settings.join.lease,
            .machines = settings.machines,
            .policies = settings.policies},
           journal->state()),
      variables(participant, executor,
                [this](const auto& request) { core.on_variable_request(request); }) {
  core.set_readers({.events = false, .statuses = false, .min_level = min_level_of(logger)});
  journal->on_recorded([this](const Ticket& ticket) { core.on_recorded(ticket); });
  journal->on_write_error([this](const std::string& error) { core.on_journal_error(error); });
}

void Gateway::Impl::publish_certificates() {
  constexpr std::chrono::hours between_checks{1};
  std::map<std::string, fabric::Notice> said = std::exchange(certificates_published, {});
  for (fabric::Notice& notice : certificate_notices(
           settings.machines, std::chrono::floor<std::chrono::seconds>(now().wall))) {
    const auto before = said.extract(notice.key.subject);
    const bool is_new = before.empty() || before.mapped().level != notice.level;
    if (is_new && notice.level != fabric::NoticeLevel::fine) {
      logger->warn("{}: {}", notice.text, notice.advice);
    }
    // One that cannot be written now is repeated with all others.
    static_cast<void>(notices.raise(notice));
    certificates_published.insert_or_assign(notice.key.subject, std::move(notice));
  }
  for (const auto& [subject, gone] : said) {
    static_cast<void>(notices.clear(gone.key.kind, subject));
  }
  certificate_timer.expires_after(between_checks);
  certificate_timer.async_wait([this](boost::system::error_code error) {
    if (!error) {
      publish_certificates();
    }
  });
}

void Gateway::Impl::heartbeat() {
  const SteadyTime next = core.heartbeat();
  call_end.assert_machines();
  heartbeat_timer.expires_at(next);
  heartbeat_timer.async_wait([this](boost::system::error_code error) {
    if (!error) {
      heartbeat();
    }
  });
}

void Gateway::Impl::publish_load() {
  constexpr std::chrono::seconds period{1};
  load_timer.expires_after(period);
  load_timer.async_wait([this](boost::system::error_code error) {
    if (!error) {
      core.publish_load();
      log_left_out();
      log_calls();
      for (const std::string& uuid : lost_services.on_time(now())) {
        static_cast<void>(notices.clear("service", uuid));
      }
      publish_load();
    }
  });
}

void Gateway::Impl::log_calls() {
  constexpr std::chrono::seconds period{60};
  if (now().steady - calls_logged_at < period) {
    return;
  }
  calls_logged_at = now().steady;
  const core::CallCounts counts = core.counts();
  const core::CallCounts before = std::exchange(calls_logged, counts);
  const std::uint64_t answered = counts.answered - before.answered;
  const std::uint64_t withdrawn = counts.withdrawn - before.withdrawn;
  if (answered + withdrawn > 0) {
    logger->info("{} {} answered in {} s, {} with an error; {} withdrawn", answered,
                 answered == 1 ? "call" : "calls", period.count(), counts.failed - before.failed,
                 withdrawn);
  }
}

void Gateway::Impl::log_left_out() {
  for (const std::string& line : complaints.due(now().steady)) {
    logger->warn("{}", line);
  }
  if (const auto left_out = instance_lines.due(now().steady)) {
    logger->warn("instances came, changed or went {} times more in {} s than is told one by one",
                 *left_out, instance_lines.window().count());
  }
}

void Gateway::Impl::start() {
  for (const CallRecord& call : journal->state().open_calls()) {
    const bool configured = std::ranges::any_of(
        settings.machines, [&](const auto& machine) { return machine.name == call.key.machine; });
    if (!configured && fabric::queue_of(call.key.machine).empty()) {
      logger->warn("call {} of {} stays in the journal: the configuration has no such machine",
                   call.id.to_string(), call.key.to_string());
    }
  }
  core.start();
  warn_of_queues();
  heartbeat();
  publish_load();
  publish_certificates();
}

/// Of message queues whose messages may be lost, or stay where they are.
void Gateway::Impl::warn_of_queues() {
  std::set<fabric::ChannelKey> configured;
  for (const auto& machine : settings.machines) {
    for (const auto& queue : machine.queues) {
      const fabric::ChannelKey key = queue.key(machine.name);
      configured.insert(key);
      if (queue.acknowledge == queues::Acknowledge::when_journalled &&
          settings.journal.folder.empty()) {
        logger->warn(
            "{}: without a journal (--journal DIR) the messages that it has read are lost if this "
            "gateway ends; drain: WHEN_ANSWERED leaves them in the controller until they are "
            "answered",
            key.to_string());
      }
    }
  }
  for (const auto& [key, queue_log] : journal->state().queues()) {
    if (!configured.contains(key) && queue_log.waiting() > 0) {
      logger->warn("{} messages of {} stay in the journal: the configuration has no such queue",
                   queue_log.waiting(), key.to_string());
    }
  }
}

void Gateway::Impl::change(const settings::Settings& wanted) {
  if (wanted.journal != settings.journal) {
    logger->warn("the journal stays as it is until this gateway is started anew");
  }
  settings.machines = wanted.machines;
  settings.policies = wanted.policies;
  core.change(settings.machines, settings.policies);
  publish_certificates();
}

void Gateway::Impl::finish(std::function<void()> then) {
  finished = std::move(then);
  core.stop();
}

Gateway::Gateway(const asio::any_io_executor& executor, SpinAfterPublish& spin,
                 const settings::Settings& settings, base::program::Log logger)
    : impl_(std::make_unique<Impl>(executor, spin, settings, std::move(logger))) {}

Gateway::~Gateway() = default;

void Gateway::finish(std::function<void()> finished) {
  impl_->finish(std::move(finished));
}

void Gateway::start() {
  impl_->start();
}

void Gateway::change(const settings::Settings& settings) {
  impl_->change(settings);
}

}  // namespace millrace::gateway::shell
