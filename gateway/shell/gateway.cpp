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
#include "gateway/shell/certificate_alarms.hpp"

namespace millrace::gateway::shell {

namespace {

namespace asio = boost::asio;

core::GatewayIdentity identity_of(const journal::Journal& journal,
                                  const fabric::dds::Participant& participant) {
  return {fabric::dds::make_id(participant), base::posix::host_name(),
          static_cast<std::uint32_t>(::getpid()), base::program::version(),
          journal.state().numbers().epoch};
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

Gateway::Gateway(const asio::any_io_executor& executor, SpinAfterPublish& spin,
                 const settings::Settings& settings, base::program::Log log)
    : executor_(executor),
      spin_(spin),
      log_(std::move(log)),
      settings_(settings),
      journal_(open_journal(executor, settings, log_)),
      timer_(executor, [this] { core_.on_time(); }),
      heartbeat_timer_(executor),
      load_timer_(executor),
      certificate_timer_(executor),
      participant_(settings.join),
      own_(identity_of(*journal_, participant_)),
      call_endpoint_(participant_, executor, *this),
      command_endpoint_(participant_, executor, *this),
      alarms_(participant_, executor,
              {.key = {.responder = own_.id},
               .program = "gateway",
               .host = own_.host,
               .pid = own_.pid}),
      gateway_monitor_(participant_, executor, *this),
      core_(*this, *this,
            {.own = own_,
             .lease = settings.join.lease,
             .machines = settings.machines,
             .policies = settings.policies,
             .journal =
                 settings.no_journal ? fabric::JournalState::none : fabric::JournalState::kept},
            journal_->state()),
      variables_(
          participant_, executor,
          [this](const auto& request) { core_.on_variable_request(request); },
          [this](const std::string& reason) { on_ignored(reason); }) {
  core_.set_readers({.events = false, .statuses = false, .min_level = min_level_of(log_)});
  journal_->on_recorded([this](const Ticket& ticket) { core_.on_recorded(ticket); });
  journal_->on_write_error([this](const fabric::Message& error) { core_.on_journal_error(error); });
}

void Gateway::publish_certificates() {
  constexpr std::chrono::hours between_checks{1};
  std::map<std::string, fabric::Alarm> said = std::exchange(certificates_published_, {});
  for (fabric::Alarm& alarm : certificate_alarms(
           settings_.machines, std::chrono::floor<std::chrono::seconds>(now().wall))) {
    const auto before = said.extract(alarm.key.subject);
    const bool is_new = before.empty() || before.mapped().level != alarm.level;
    if (is_new && alarm.level != fabric::AlarmLevel::fine) {
      log_->warn("{}: {}", alarm.text, alarm.advice);
    }
    // An alarm that cannot be written now is repeated with all others.
    static_cast<void>(alarms_.raise(alarm));
    certificates_published_.insert_or_assign(alarm.key.subject, std::move(alarm));
  }
  for (const auto& [subject, gone] : said) {
    static_cast<void>(alarms_.clear(gone.key.kind, subject));
  }
  certificate_timer_.expires_after(between_checks);
  certificate_timer_.async_wait([this](boost::system::error_code error) {
    if (!error) {
      publish_certificates();
    }
  });
}

void Gateway::heartbeat() {
  const SteadyTime next = core_.heartbeat();
  call_endpoint_.assert_machines();
  heartbeat_timer_.expires_at(next);
  heartbeat_timer_.async_wait([this](boost::system::error_code error) {
    if (!error) {
      heartbeat();
    }
  });
}

void Gateway::publish_load() {
  constexpr std::chrono::seconds period{1};
  load_timer_.expires_after(period);
  load_timer_.async_wait([this](boost::system::error_code error) {
    if (!error) {
      core_.publish_load();
      log_left_out();
      log_calls();
      for (const std::string& uuid : lost_services_.on_time(now())) {
        static_cast<void>(alarms_.clear("service", uuid));
      }
      for (const std::string& uuid : error_series_.on_time(now().steady)) {
        static_cast<void>(alarms_.clear("errors", uuid));
      }
      publish_load();
    }
  });
}

void Gateway::log_calls() {
  constexpr std::chrono::seconds period{60};
  if (now().steady - calls_logged_at_ < period) {
    return;
  }
  calls_logged_at_ = now().steady;
  const core::CallCounts counts = core_.counts();
  const core::CallCounts before = std::exchange(calls_logged_, counts);
  const std::uint64_t answered = counts.answered - before.answered;
  const std::uint64_t withdrawn = counts.withdrawn - before.withdrawn;
  if (answered + withdrawn > 0) {
    log_->info("{} {} answered in {} s, {} with an error; {} withdrawn", answered,
               answered == 1 ? "call" : "calls", period.count(), counts.failed - before.failed,
               withdrawn);
  }
}

void Gateway::log_left_out() {
  for (const std::string& line : log_limiter_.due(now().steady)) {
    log_->warn("{}", line);
  }
  if (const auto left_out = instance_lines_.due(now().steady)) {
    log_->warn("{} more changes of instances in {} s were not logged one by one", *left_out,
               instance_lines_.window().count());
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
        alarms_.raise({.key = {.kind = "no_journal"},
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
  static_cast<void>(alarms_.clear(kind_of_configuration, ""));
  publish_certificates();
}

void Gateway::refuse(const std::string& file, const std::string& why) {
  // An alarm that cannot be written now is repeated with all others.
  static_cast<void>(alarms_.raise(
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
