#include "gateway/shell/gateway.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <unistd.h>

#include "base/messages/catalogue.hpp"
#include "base/posix/system.hpp"
#include "base/program/version.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/dds/made_id.hpp"

namespace millrace::gateway::shell {

namespace {

namespace asio = boost::asio;

/// Then `act`, unless the gateway has ended.
template <typename Act>
void wait(asio::steady_timer& timer, Act act) {
  timer.async_wait([act](boost::system::error_code error) {
    if (!error) {
      act();
    }
  });
}

constexpr const char* kind_of_configuration = "configuration";

std::unique_ptr<journal::Journal> open_journal(const asio::any_io_executor& executor,
                                               const settings::Settings& settings,
                                               const base::program::Log& log) {
  if (!settings.no_journal) {
    log->info("the journal is in {}", settings.journal.folder.string());
    return journal::open_file(executor, settings.journal, log);
  }
  log->warn("{}", base::messages::no_journal(base::messages::without_journal()));
  return journal::in_memory(executor);
}

}  // namespace

Gateway::Endpoints::Endpoints(const asio::any_io_executor& executor,
                              const settings::Settings& settings, const journal::Journal& journal,
                              Gateway& gateway)
    : participant(settings.join),
      own{fabric::dds::make_id(participant), base::posix::host_name(),
          static_cast<std::uint32_t>(::getpid()), base::program::version(),
          journal.state().numbers().epoch},
      calls(participant, executor, gateway),
      commands(participant, executor, gateway),
      alarms(
          participant, executor,
          {.key = {.responder = own.id}, .program = "gateway", .host = own.host, .pid = own.pid}),
      gateways(participant, executor, gateway) {}

Gateway::Gateway(const asio::any_io_executor& executor, SpinAfterPublish& spin,
                 const settings::Settings& settings, base::program::Log log)
    : spin_(spin),
      log_(std::move(log)),
      settings_(settings),
      journal_(open_journal(executor, settings, log_)),
      timers_{WakeTimer(executor, [this] { core_.on_time(); }), asio::steady_timer(executor),
              asio::steady_timer(executor), asio::steady_timer(executor)},
      fabric_(executor, settings, *journal_, *this),
      alarms_(fabric_.alarms, log_),
      core_(*this, *this,
            {.own = fabric_.own,
             .lease = settings.join.lease,
             .machines = settings.machines,
             .policies = settings.policies,
             .journal =
                 settings.no_journal ? fabric::JournalState::none : fabric::JournalState::kept},
            journal_->state()),
      variables_(
          fabric_.participant, executor,
          [this](const auto& request) { core_.on_variable_request(request); },
          [this](const std::string& reason) { on_ignored(reason); }) {
  core_.set_readers({.events = false, .statuses = false, .min_level = min_level_of(log_)});
  journal_->on_recorded([this](const Ticket& ticket) { core_.on_recorded(ticket); });
  journal_->on_write_error([this](const fabric::Message& error) { core_.on_journal_error(error); });
}

void Gateway::publish_certificates() {
  constexpr std::chrono::hours between_checks{1};
  alarms_.publish_certificates(settings_.machines, now());
  timers_.certificates.expires_after(between_checks);
  wait(timers_.certificates, [this] { publish_certificates(); });
}

void Gateway::heartbeat() {
  const SteadyTime next = core_.heartbeat();
  fabric_.calls.assert_machines();
  timers_.heartbeat.expires_at(next);
  wait(timers_.heartbeat, [this] { heartbeat(); });
}

void Gateway::publish_load() {
  constexpr std::chrono::seconds period{1};
  timers_.load.expires_after(period);
  wait(timers_.load, [this] {
    core_.publish_load();
    for (const std::string& line : log_limiter_.due(now().steady)) {
      log_->warn("{}", line);
    }
    alarms_.on_time(now());
    log_calls();
    publish_load();
  });
}

void Gateway::log_calls() {
  constexpr std::chrono::seconds period{60};
  if (now().steady - logged_calls_.at < period) {
    return;
  }
  const core::CallCounts counts = core_.counts();
  const core::CallCounts before =
      std::exchange(logged_calls_, {.counts = counts, .at = now().steady}).counts;
  const std::uint64_t answered = counts.answered - before.answered;
  const std::uint64_t withdrawn = counts.withdrawn - before.withdrawn;
  if (answered + withdrawn > 0) {
    log_->info("{} {} answered in {} s, {} with an error; {} withdrawn", answered,
               answered == 1 ? "call" : "calls", period.count(), counts.failed - before.failed,
               withdrawn);
  }
}

void Gateway::start() {
  for (const CallRecord& call : journal_->state().open_calls()) {
    const bool configured = std::ranges::any_of(
        settings_.machines, [&](const auto& machine) { return machine.name == call.key.machine; });
    if (!configured && fabric::queue_of(call.key.machine).empty()) {
      log_->warn("call {} of {} stays in the journal: its machine is not in the configuration",
                 call.id.to_string(), call.key.to_string());
    }
  }
  core_.start();
  if (settings_.no_journal) {
    // An alarm that cannot be written now is repeated with all others.
    static_cast<void>(
        fabric_.alarms.raise({.key = {.kind = "no_journal"},
                              .level = fabric::AlarmLevel::warning,
                              .text = base::messages::no_journal(base::messages::without_journal()),
                              .advice = base::messages::start_with_journal()}));
  }
  warn_of_queues();
  heartbeat();
  publish_load();
  publish_certificates();
}

/// Warns of message queues whose messages may be lost, or stay in the journal.
void Gateway::warn_of_queues() {
  std::set<fabric::ChannelKey> configured;
  for (const auto& machine : settings_.machines) {
    for (const auto& queue : machine.queues) {
      const fabric::ChannelKey key = queue.key(machine.name);
      configured.insert(key);
      if (queue.acknowledge == queues::Acknowledge::when_journalled && settings_.no_journal) {
        log_->warn(
            "{}: without a journal, the messages that were read are lost if this "
            "gateway ends; drain: WHEN_ANSWERED leaves them in the controller until they have a "
            "response",
            key.to_string());
      }
    }
  }
  for (const auto& [key, queue_log] : journal_->state().queues()) {
    if (!configured.contains(key) && queue_log.waiting() > 0) {
      log_->warn("{} messages of {} stay in the journal: their queue is not in the configuration",
                 queue_log.waiting(), key.to_string());
    }
  }
}

void Gateway::change(const settings::Settings& settings) {
  if (settings.journal != settings_.journal || settings.no_journal != settings_.no_journal) {
    log_->warn("the change of the journal takes effect when this gateway is restarted");
  }
  settings_.machines = settings.machines;
  settings_.policies = settings.policies;
  core_.change(settings_.machines, settings_.policies);
  static_cast<void>(fabric_.alarms.clear(kind_of_configuration, ""));
  publish_certificates();
}

void Gateway::refuse(const std::string& file, const std::string& why) {
  // An alarm that cannot be written now is repeated with all others.
  static_cast<void>(fabric_.alarms.raise(
      {.key = {.kind = kind_of_configuration},
       .level = fabric::AlarmLevel::problem,
       .text = fmt::format("the changed configuration is not in use: {}", why),
       .advice = fmt::format("correct {}, then reload this gateway; it would not start with this "
                             "file",
                             file)}));
}

void Gateway::finish(std::function<void()> finished) {
  finished_ = std::move(finished);
  core_.stop();
}

}  // namespace millrace::gateway::shell
