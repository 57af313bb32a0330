#include "gateway/gateway.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include "fabric/call_end.hpp"
#include "fabric/command_end.hpp"
#include "fabric/gateway_watch.hpp"
#include "fabric/participant.hpp"
#include "gateway/core.hpp"
#include "gateway/journal/journal.hpp"
#include "gateway/machine_link.hpp"
#include "gateway/machines.hpp"
#include "gateway/pulse.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway {

namespace {

namespace asio = boost::asio;

/// The only place of the gateway that reads a clock.
Moment moment_now() {
  return {std::chrono::steady_clock::now(),
          std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now())};
}

GatewayIdentity identity_of(const journal::Journal& journal) {
  boost::system::error_code unnamed;
  return {fabric::InstanceId::random(), asio::ip::host_name(unnamed),
          static_cast<std::uint32_t>(::getpid()), MILLRACE_VERSION,
          journal.ledger().numbers().epoch};
}

std::string_view word_for(fabric::CommandKind kind) {
  switch (kind) {
    case fabric::CommandKind::answer:
      return "answer";
    case fabric::CommandKind::retry:
      return "retry";
    case fabric::CommandKind::drain:
      return "drain";
    case fabric::CommandKind::ping:
      return "ping";
  }
  return "command";
}

std::unique_ptr<journal::Journal> open_journal(const asio::any_io_executor& executor,
                                               const Settings& settings,
                                               const idl::program::Log& log) {
  if (!settings.journal.folder.empty()) {
    return journal::open_file(executor, settings.journal, log);
  }
  log->info(
      "no journal (--journal DIR): if this gateway ends while it writes an answer, that program "
      "waits on, and a call under way is given out again under a new id");
  return journal::in_memory(executor);
}

spdlog::level::level_enum level_of(Level level) {
  switch (level) {
    case Level::debug:
      return spdlog::level::debug;
    case Level::info:
      return spdlog::level::info;
    case Level::warn:
      return spdlog::level::warn;
    case Level::error:
      return spdlog::level::err;
  }
  return spdlog::level::info;
}

}  // namespace

struct Gateway::Impl final : fabric::CallEndListener,
                             fabric::CommandListener,
                             fabric::GatewayWatchListener,
                             MachinesHands,
                             MachinesListener {
  Impl(const asio::any_io_executor& the_executor, Attention& the_attention, Settings the_settings,
       idl::program::Log the_log)
      : executor(the_executor),
        attention(the_attention),
        log(std::move(the_log)),
        settings(std::move(the_settings)),
        journal(open_journal(executor, settings, log)),
        core({.paces = paces_of(settings.machines), .policies = settings.policies},
             journal->ledger()),
        timer(executor),
        last_chance(executor),
        pulse(settings.join.lease),
        pulse_timer(executor),
        load_timer(executor),
        own(identity_of(*journal)),
        participant(settings.join),
        call_end(participant, executor, *this),
        command_end(participant, executor, *this),
        watch(participant, executor, *this),
        machines(own, *this, *this) {
    journal->on_trouble(
        [this](const std::string& trouble) { carry_out(core.set_obstacle(trouble, now())); });
  }

  Moment now() override {
    const Moment moment = moment_now();
    if (const auto late = pulse.late(moment.steady)) {
      if (machines.stood_still() || *late > settings.join.lease) {
        log->warn("this gateway stood still for {:.1f} s",
                  std::chrono::duration<double>(*late).count());
      }
    }
    return moment;
  }

  void beat() {
    pulse_timer.expires_at(pulse.beat(now().steady));
    pulse_timer.async_wait([this](boost::system::error_code error) {
      if (!error) {
        beat();
      }
    });
  }

  void tell_load() {
    constexpr std::chrono::seconds period{1};
    load_timer.expires_after(period);
    load_timer.async_wait([this](boost::system::error_code error) {
      if (!error) {
        machines.tell_load();
        tell_load();
      }
    });
  }

  // What the machines need.
  void after(std::chrono::nanoseconds delay, std::function<void()> act) override {
    auto wait = std::make_shared<asio::steady_timer>(executor, delay);
    wait->async_wait([wait, act = std::move(act)](boost::system::error_code error) {
      if (!error) {
        act();
      }
    });
  }
  std::unique_ptr<Link> connect(const MachineSettings& machine, LinkEvents& events) override {
    auto link = std::make_unique<MachineLink>(executor, machine, events, log);
    link->start();
    return link;
  }
  void say(Level level, const std::string& text) override { log->log(level_of(level), text); }

  void start() {
    for (const Call& call : journal->ledger().open_calls()) {
      const bool configured = std::ranges::any_of(
          settings.machines, [&](const auto& machine) { return machine.name == call.key.machine; });
      if (!configured) {
        log->warn("call {} of {} stays in the journal: the configuration has no such machine",
                  call.id.to_string(), call.key.to_string());
      }
    }
    machines.set(settings.machines);
    beat();
    tell_load();
  }

  void change(const Settings& wanted) {
    if (wanted.journal != settings.journal) {
      log->warn("the journal stays as it is until this gateway is started anew");
    }
    settings.machines = wanted.machines;
    settings.policies = wanted.policies;
    carry_out(core.change(paces_of(settings.machines), settings.policies, now()));
    machines.set(settings.machines);
  }

  // What happens on the machines.
  void on_link_up(const std::string& machine, const std::vector<std::uint16_t>& channels) override {
    carry_out(core.on_link_up(machine, channels, now()));
  }
  void on_link_down(const std::string& machine, const std::string& reason) override {
    carry_out(core.on_link_down(machine, reason, now()));
  }
  void on_link_dropped(const std::string& machine, const std::string& reason) override {
    carry_out(core.on_link_dropped(machine, reason, moment_now()));
  }
  void on_retired(const fabric::ChannelKey& key) override { carry_out(core.retire(key, now())); }
  void on_refused(const fabric::ChannelKey& key, const std::string& reason) override {
    carry_out(core.release(key, reason, now()));
  }
  void on_inherited(const fabric::ChannelStatus& status, const std::string& from) override {
    core.inherit(status.key, {status.uuid, from, status.call});
  }
  void on_contested() override { watch.watch_channels(); }
  [[nodiscard]] std::vector<std::uint16_t> channels_of(const std::string& machine) const override {
    return core.channels_of(machine);
  }
  void on_machine_status(const fabric::MachineStatus& status) override {
    if (const auto published = call_end.publish(status); !published) {
      log->debug("{}: a status is lost: {}", status.machine, published.error());
    }
  }
  void on_machine_left(const fabric::MachineStatus& status) override { call_end.let_go(status); }
  void on_read(const fabric::ChannelKey& key, const Picture& picture) override {
    carry_out(core.on_read(key, picture, now()));
  }
  void on_read_failed(const fabric::ChannelKey& key, const std::string& reason) override {
    carry_out(core.on_read_failed(key, reason, now()));
  }
  void on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                const std::string& reason) override {
    carry_out(core.on_write(key, outcome, reason, now()));
  }

  // What other gateways say.
  void on_machine(const fabric::MachineStatus& status) override { machines.on_machine(status); }
  void on_machine_gone(const std::string& machine, const fabric::InstanceId& gateway) override {
    machines.on_machine_gone(machine, gateway);
  }
  void on_channel(const fabric::ChannelStatus& status) override { machines.on_channel(status); }

  // What happens on the fabric.
  void on_instance_ready(const fabric::InstanceIdentity& instance) override {
    log->info("instance {} of {} is ready: {} on {}, pid {}", instance.id.to_string(),
              instance.uuid, instance.name, instance.host, instance.pid);
    carry_out(core.on_instance_ready(instance, now()));
  }
  void on_instance_changed(const fabric::InstanceIdentity& instance) override {
    log->info("instance {} of {} changed{}", instance.id.to_string(), instance.uuid,
              instance.draining ? ": it is draining" : "");
    carry_out(core.on_instance_ready(instance, now()));
  }
  void on_instance_gone(const fabric::InstanceId& instance) override {
    log->info("instance {} is gone", instance.to_string());
    carry_out(core.on_instance_gone(instance, now()));
  }
  void on_reply(const fabric::Reply& reply) override { carry_out(core.on_reply(reply, now())); }
  void on_ignored(const std::string& reason) override { log->warn("{}", reason); }

  // What an operator wants. Commands for channels of others are theirs.
  void on_command(const fabric::Command& command) override {
    if (command.kind == fabric::CommandKind::drain || !core.serves(command.key)) {
      return;
    }
    const Verdict verdict = obey(command);
    log->log(command.kind == fabric::CommandKind::ping ? spdlog::level::debug : spdlog::level::info,
             "{}: {} by {}: {}", command.key.to_string(), word_for(command.kind), command.issuer,
             verdict.detail);
    const auto published = command_end.publish(
        {own.id, command.id, verdict.done, fit_reason(verdict.detail), now().wall});
    if (!published) {
      log->warn("the outcome of a command cannot be told: {}", published.error());
    }
  }

  Verdict obey(const fabric::Command& command) {
    Verdict verdict;
    if (command.kind == fabric::CommandKind::retry) {
      carry_out(core.on_retry(command.key, command.call, command.issuer, verdict, now()));
    } else if (command.kind == fabric::CommandKind::ping) {
      verdict = {true, "serves it"};
    } else if (command.state == 0) {
      verdict.detail = "state 0 releases no program; name another one";
    } else {
      carry_out(core.on_answer(command.key, command.call,
                               {command.text, command.state, command.issuer}, verdict, now()));
    }
    return verdict;
  }

  void carry_out(const ChannelActions& actions) {
    for (const ChannelAction& one : actions) {
      std::visit([&](const auto& action) { carry_out(one.key, action); }, one.action);
    }
    arm_timer();
    if (finished && !core.answering()) {
      end();
    }
  }

  void end() {
    const std::function<void()> then = std::exchange(finished, {});
    carry_out(core.take_back(now()));
    then();
  }

  void finish(std::function<void()> then) {
    constexpr std::chrono::seconds patience{2};
    finished = std::move(then);
    last_chance.expires_after(patience);
    last_chance.async_wait([this](boost::system::error_code error) {
      if (!error && finished) {
        log->warn("ending with an answer half written; the journal knows how to go on");
        end();
      }
    });
    carry_out(core.set_obstacle("the gateway is ending", now()));
  }

  void carry_out(const fabric::ChannelKey& key, const Read& action) {
    machines.read(key, action.look);
  }
  void carry_out(const fabric::ChannelKey& key, const Write& action) {
    machines.write(key, action.variable, action.value);
  }
  void carry_out(const fabric::ChannelKey& key, const WakeAt& action) {
    asio::steady_timer& wake = wakes.try_emplace(key, executor).first->second;
    if (wake.expiry() == action.at) {
      return;
    }
    wake.expires_at(action.at);
    wake.async_wait([this, key](boost::system::error_code error) {
      if (!error) {
        carry_out(core.on_wake(key, now()));
      }
    });
  }
  void carry_out(const fabric::ChannelKey& key, const Record& action) {
    journal->append(action.entry, [this, key, ticket = action.ticket] {
      carry_out(core.on_recorded(key, ticket, now()));
    });
  }
  void carry_out(const fabric::ChannelKey& key, const Publish& action) {
    if (const auto published = call_end.publish(action.request); !published) {
      log->error("{}: call {} cannot be given out: {}", key.to_string(),
                 action.request.call.to_string(), published.error());
    }
    attention.expect();
  }
  void carry_out(const fabric::ChannelKey& key, const Withdraw& action) {
    call_end.withdraw(key, action.uuid);
  }
  void carry_out(const fabric::ChannelKey& key, const Tell& action) {
    if (const auto published = call_end.publish(action.event); !published) {
      log->debug("{}: an event is lost: {}", key.to_string(), published.error());
    }
  }
  void carry_out(const fabric::ChannelKey& key, const Show& action) {
    if (const auto published = call_end.publish(action.status); !published) {
      log->debug("{}: a status is lost: {}", key.to_string(), published.error());
    }
  }
  void carry_out(const fabric::ChannelKey& key, const Hide&) {
    wakes.erase(key);
    call_end.let_go(key);
    machines.on_over(key);
  }
  void carry_out(const fabric::ChannelKey& key, const Say& action) {
    log->log(level_of(action.level), "{}: {}", key.to_string(), action.text);
  }
  // The core keeps these to itself.
  void carry_out(const fabric::ChannelKey&, const Offer&) {}
  void carry_out(const fabric::ChannelKey&, const LeaveBe&) {}
  void carry_out(const fabric::ChannelKey&, const Resume&) {}
  void carry_out(const fabric::ChannelKey&, const Freed&) {}

  void arm_timer() {
    const auto next = core.next_time();
    if (next == armed) {
      return;
    }
    armed = next;
    timer.cancel();
    if (!next) {
      return;
    }
    timer.expires_at(*next);
    timer.async_wait([this](boost::system::error_code error) {
      if (!error) {
        armed.reset();
        carry_out(core.on_time(now()));
      }
    });
  }

  asio::any_io_executor executor;
  Attention& attention;
  idl::program::Log log;
  Settings settings;
  std::unique_ptr<journal::Journal> journal;
  Core core;
  asio::steady_timer timer;
  std::optional<SteadyTime> armed;
  asio::steady_timer last_chance;
  std::function<void()> finished;
  std::map<fabric::ChannelKey, asio::steady_timer> wakes;
  Pulse pulse;
  asio::steady_timer pulse_timer;
  asio::steady_timer load_timer;
  GatewayIdentity own;
  fabric::Participant participant;
  fabric::CallEnd call_end;
  fabric::CommandEnd command_end;
  fabric::GatewayWatch watch;
  Machines machines;
};

Gateway::Gateway(const asio::any_io_executor& executor, Attention& attention,
                 const Settings& settings, idl::program::Log log)
    : impl_(std::make_unique<Impl>(executor, attention, settings, std::move(log))) {}

Gateway::~Gateway() = default;

void Gateway::finish(std::function<void()> finished) {
  impl_->finish(std::move(finished));
}

void Gateway::start() {
  impl_->start();
}

void Gateway::change(const Settings& settings) {
  impl_->change(settings);
}

}  // namespace millrace::gateway
