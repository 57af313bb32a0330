#include "gateway/live/gateway.hpp"

#include <algorithm>
#include <utility>

#include <boost/asio/post.hpp>
#include <unistd.h>

#include "base/posix/host.hpp"
#include "fabric/channel_scope.hpp"
#include "gateway/live/certificate_notices.hpp"
#include "gateway/live/gateway_impl.hpp"
#include "gateway/live/machine_link.hpp"

namespace millrace::gateway::live {

namespace {

namespace asio = boost::asio;

machines::GatewayIdentity identity_of(const journal::Journal& journal) {
  return {fabric::InstanceId::random(), base::posix::host_name(),
          static_cast<std::uint32_t>(::getpid()), MILLRACE_VERSION,
          journal.ledger().numbers().epoch};
}

std::unique_ptr<journal::Journal> open_journal(const asio::any_io_executor& executor,
                                               const settings::Settings& settings,
                                               const base::program::Log& log) {
  if (!settings.journal.folder.empty()) {
    return journal::open_file(executor, settings.journal, log);
  }
  log->info(
      "no journal (--journal DIR): if this gateway ends while it writes an answer, that program "
      "waits on, and a call under way is given out again under a new id");
  return journal::in_memory(executor);
}

}  // namespace

Gateway::Impl::Impl(const asio::any_io_executor& the_executor, SpinAfterPublish& the_spin,
                    settings::Settings the_settings, base::program::Log the_log)
    : executor(the_executor),
      spin(the_spin),
      log(std::move(the_log)),
      settings(std::move(the_settings)),
      journal(open_journal(executor, settings, log)),
      control({.paces = settings::paces_of(settings.machines), .policies = settings.policies},
              journal->ledger()),
      timer(executor),
      last_chance(executor),
      stall(settings.join.lease),
      stall_timer(executor),
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
      data(
          executor, participant, [this] { return now(); }, log),
      variables(
          executor, participant, [this] { return now(); },
          {.begin_event = [this] { begin_event(); },
           .written = [this](const auto& written) { tell(written); }},
          log),
      queues(*this, *this),
      machines(own, *this, *this) {
  static_cast<void>(
      control.set_interest({.events = false, .statuses = false, .least = least_of(log)}, now()));
  journal->on_recorded([this](const Ticket& ticket) { on_recorded(ticket); });
  journal->on_trouble([this](const std::string& trouble) {
    begin_event();
    carry_out(control.set_journal_trouble(trouble, now()));
    set_notice({.kind = "journal"}, trouble,
               "make room on the disk, or give it its folder back; it goes on by itself");
  });
}

void Gateway::Impl::set_notice(const fabric::NoticeKey& key, const std::string& text,
                               const std::string& advice) {
  const auto told = text.empty() ? notices.clear(key.kind, key.subject)
                                 : notices.raise({.key = key,
                                                  .level = fabric::NoticeLevel::problem,
                                                  .text = text,
                                                  .advice = advice});
  if (!told) {
    log->warn("nobody but this log is told of it: {}", told.error());
  }
}

void Gateway::Impl::tell_certificates() {
  constexpr std::chrono::hours between_looks{1};
  std::map<std::string, fabric::Notice> said = std::exchange(certificates_told, {});
  for (fabric::Notice& notice : certificate_notices(
           settings.machines, std::chrono::floor<std::chrono::seconds>(now().wall))) {
    const auto before = said.extract(notice.key.subject);
    const bool is_new = before.empty() || before.mapped().level != notice.level;
    if (is_new && notice.level != fabric::NoticeLevel::fine) {
      log->warn("{}: {}", notice.text, notice.advice);
    }
    // One that cannot be written now is repeated with all others.
    static_cast<void>(notices.raise(notice));
    certificates_told.insert_or_assign(notice.key.subject, std::move(notice));
  }
  for (const auto& [subject, gone] : said) {
    static_cast<void>(notices.clear(gone.key.kind, subject));
  }
  certificate_timer.expires_after(between_looks);
  certificate_timer.async_wait([this](boost::system::error_code error) {
    if (!error) {
      begin_event();
      tell_certificates();
    }
  });
}

Moment Gateway::Impl::now() const {
  return {std::chrono::steady_clock::now(),
          std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now())};
}

void Gateway::Impl::begin_event() {
  if (const auto late = stall.late(now().steady)) {
    on_stall(*late);
  }
}

void Gateway::Impl::on_stall(std::chrono::nanoseconds late) {
  if (machines.stood_still() || late > settings.join.lease) {
    log->warn("this gateway stood still for {:.1f} s", std::chrono::duration<double>(late).count());
  }
}

void Gateway::Impl::beat() {
  begin_event();
  call_end.assert_machines();
  stall_timer.expires_at(stall.beat(now().steady));
  stall_timer.async_wait([this](boost::system::error_code error) {
    if (!error) {
      beat();
    }
  });
}

void Gateway::Impl::tell_load() {
  constexpr std::chrono::seconds period{1};
  load_timer.expires_after(period);
  load_timer.async_wait([this](boost::system::error_code error) {
    if (!error) {
      begin_event();
      machines.tell_load();
      queues.tell_numbers();
      tell_left_out();
      tell_calls();
      for (const std::string& uuid : lost_services.on_time(now())) {
        static_cast<void>(notices.clear("service", uuid));
      }
      tell_load();
    }
  });
}

void Gateway::Impl::tell_calls() {
  constexpr std::chrono::seconds period{60};
  if (now().steady - calls_told_at < period) {
    return;
  }
  calls_told_at = now().steady;
  const control::CallCounts counts = control.counts();
  const control::CallCounts before = std::exchange(calls_told, counts);
  const std::uint64_t answered = counts.answered - before.answered;
  const std::uint64_t withdrawn = counts.withdrawn - before.withdrawn;
  if (answered + withdrawn > 0) {
    log->info("{} {} answered in {} s, {} with an error; {} withdrawn", answered,
              answered == 1 ? "call" : "calls", period.count(), counts.failed - before.failed,
              withdrawn);
  }
}

void Gateway::Impl::tell_left_out() {
  for (const std::string& line : complaints.due(now().steady)) {
    log->warn("{}", line);
  }
  if (const auto left_out = instance_lines.due(now().steady)) {
    log->warn("instances came, changed or went {} times more in {} s than is told one by one",
              *left_out, instance_lines.window().count());
  }
}

void Gateway::Impl::after(std::chrono::nanoseconds delay, std::function<void()> act) {
  if (delay == std::chrono::nanoseconds(0)) {
    // In their order, which timers do not keep.
    asio::post(executor, [this, act = std::move(act), alive = std::weak_ptr(life)] {
      if (!alive.expired()) {
        begin_event();
        act();
      }
    });
    return;
  }
  auto wait = std::make_shared<asio::steady_timer>(executor, delay);
  wait->async_wait([this, wait, act = std::move(act),
                    alive = std::weak_ptr(life)](boost::system::error_code error) {
    if (!error && !alive.expired()) {
      begin_event();
      act();
    }
  });
}

std::unique_ptr<machines::Link> Gateway::Impl::connect(const settings::MachineSettings& machine,
                                                       machines::LinkEvents& events) {
  if (!gate) {
    gate.emplace([this] { begin_event(); }, events);
  }
  auto link = std::make_unique<MachineLink>(executor, machine, *gate, log);
  clients[machine.name] = link->client();
  data.connect(machine.name, link->client(), link->location());
  variables.connect(machine.name, link->client(), link->location());
  link->start();
  return link;
}

void Gateway::Impl::say(Level level, const std::string& text) {
  log->log(level_of(level), text);
}

void Gateway::Impl::start() {
  for (const Call& call : journal->ledger().open_calls()) {
    const bool configured = std::ranges::any_of(
        settings.machines, [&](const auto& machine) { return machine.name == call.key.machine; });
    if (!configured && fabric::queue_of(call.key.machine).empty()) {
      log->warn("call {} of {} stays in the journal: the configuration has no such machine",
                call.id.to_string(), call.key.to_string());
    }
  }
  data.set(settings.machines);
  variables.set(settings.machines);
  queues.set(settings::queues_of(settings.machines), journal->ledger().queues());
  warn_of_volatile_queues();
  machines.set(settings.machines);
  beat();
  tell_load();
  tell_certificates();
}

void Gateway::Impl::change(const settings::Settings& wanted) {
  begin_event();
  if (wanted.journal != settings.journal) {
    log->warn("the journal stays as it is until this gateway is started anew");
  }
  settings.machines = wanted.machines;
  settings.policies = wanted.policies;
  carry_out(control.change(settings::paces_of(settings.machines), settings.policies, now()));
  data.set(settings.machines);
  variables.set(settings.machines);
  queues.set(settings::queues_of(settings.machines), journal->ledger().queues());
  machines.set(settings.machines);
  tell_certificates();
}

void Gateway::Impl::end() {
  const std::function<void()> then = std::exchange(finished, {});
  carry_out(control.take_back(now()));
  then();
}

void Gateway::Impl::finish(std::function<void()> then) {
  constexpr std::chrono::seconds patience{2};
  finished = std::move(then);
  last_chance.expires_after(patience);
  last_chance.async_wait([this](boost::system::error_code error) {
    if (!error && finished) {
      begin_event();
      log->warn("ending with an answer half written; the journal knows how to go on");
      end();
    }
  });
  begin_event();
  carry_out(control.set_obstacle("the gateway is ending", now()));
}

void Gateway::Impl::arm_timer() {
  const auto next = control.next_time();
  // One that is armed for an earlier time comes too early: that costs less than to move it.
  if (!next || (armed && *armed <= *next)) {
    return;
  }
  armed = next;
  timer.expires_at(*next);
  timer.async_wait([this](boost::system::error_code error) {
    if (!error) {
      armed.reset();
      begin_event();
      carry_out(control.on_time(now()));
    }
  });
}

Gateway::Gateway(const asio::any_io_executor& executor, SpinAfterPublish& spin,
                 const settings::Settings& settings, base::program::Log log)
    : impl_(std::make_unique<Impl>(executor, spin, settings, std::move(log))) {}

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

}  // namespace millrace::gateway::live
