#include "gateway/gateway.hpp"

#include <map>
#include <optional>
#include <utility>

#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>

#include "fabric/call_end.hpp"
#include "fabric/command_end.hpp"
#include "fabric/participant.hpp"
#include "gateway/core.hpp"
#include "gateway/journal/journal.hpp"
#include "gateway/machine_link.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway {

namespace {

namespace asio = boost::asio;

/// The only place of the gateway that reads a clock.
Moment moment_now() {
  return {std::chrono::steady_clock::now(),
          std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now())};
}

CoreOptions core_options(const Settings& settings) {
  CoreOptions options;
  options.policies = settings.policies;
  for (const MachineSettings& machine : settings.machines) {
    options.paces[machine.name] = machine.pace;
  }
  return options;
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

struct Gateway::Impl final : fabric::CallEndListener, fabric::CommandListener, LinkEvents {
  Impl(const asio::any_io_executor& the_executor, const Settings& settings,
       idl::program::Log the_log)
      : executor(the_executor),
        log(std::move(the_log)),
        journal(open_journal(executor, settings, log)),
        core(core_options(settings), journal->ledger()),
        timer(executor),
        last_chance(executor),
        participant(settings.join),
        call_end(participant, executor, *this),
        command_end(participant, executor, *this) {
    for (const MachineSettings& machine : settings.machines) {
      links.try_emplace(machine.name, executor, machine, *this, log);
    }
    journal->on_trouble([this](const std::string& trouble) {
      carry_out(core.set_obstacle(trouble, moment_now()));
    });
  }

  // What happens on the machines.
  void on_link_up(const std::string& machine, const std::vector<std::uint16_t>& channels) override {
    carry_out(core.on_link_up(machine, channels, moment_now()));
  }
  void on_link_down(const std::string& machine, const std::string& reason) override {
    carry_out(core.on_link_down(machine, reason, moment_now()));
  }
  void on_read(const fabric::ChannelKey& key, const Picture& picture) override {
    carry_out(core.on_read(key, picture, moment_now()));
  }
  void on_read_failed(const fabric::ChannelKey& key, const std::string& reason) override {
    carry_out(core.on_read_failed(key, reason, moment_now()));
  }
  void on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                const std::string& reason) override {
    carry_out(core.on_write(key, outcome, reason, moment_now()));
  }

  // What happens on the fabric.
  void on_instance_ready(const fabric::InstanceIdentity& instance) override {
    log->info("instance {} of {} is ready: {} on {}, pid {}", instance.id.to_string(),
              instance.uuid, instance.name, instance.host, instance.pid);
    carry_out(core.on_instance_ready(instance, moment_now()));
  }
  void on_instance_changed(const fabric::InstanceIdentity& instance) override {
    log->info("instance {} of {} changed{}", instance.id.to_string(), instance.uuid,
              instance.draining ? ": it is draining" : "");
    carry_out(core.on_instance_ready(instance, moment_now()));
  }
  void on_instance_gone(const fabric::InstanceId& instance) override {
    log->info("instance {} is gone", instance.to_string());
    carry_out(core.on_instance_gone(instance, moment_now()));
  }
  void on_reply(const fabric::Reply& reply) override {
    carry_out(core.on_reply(reply, moment_now()));
  }
  void on_ignored(const std::string& reason) override { log->warn("{}", reason); }

  // What an operator wants. Commands for channels of others are theirs.
  void on_command(const fabric::Command& command) override {
    if (command.kind == fabric::CommandKind::drain || !core.serves(command.key)) {
      return;
    }
    const Verdict verdict = obey(command);
    log->info("{}: {} by {}: {}", command.key.to_string(),
              command.kind == fabric::CommandKind::answer ? "answer" : "retry", command.issuer,
              verdict.detail);
    const auto published = command_end.publish(
        {id, command.id, verdict.done, fit_reason(verdict.detail), moment_now().wall});
    if (!published) {
      log->warn("the outcome of a command cannot be told: {}", published.error());
    }
  }

  Verdict obey(const fabric::Command& command) {
    Verdict verdict;
    if (command.kind == fabric::CommandKind::retry) {
      carry_out(core.on_retry(command.key, command.call, command.issuer, verdict, moment_now()));
    } else if (command.state == 0) {
      verdict.detail = "state 0 releases no program; name another one";
    } else {
      carry_out(core.on_answer(command.key, command.call,
                               {command.text, command.state, command.issuer}, verdict,
                               moment_now()));
    }
    return verdict;
  }

  void carry_out(const ChannelActions& actions) {
    for (const ChannelAction& one : actions) {
      std::visit([&](const auto& action) { carry_out(one.key, action); }, one.action);
    }
    arm_timer();
    if (finished && !core.answering()) {
      std::exchange(finished, {})();
    }
  }

  void finish(std::function<void()> then) {
    constexpr std::chrono::seconds patience{2};
    finished = std::move(then);
    last_chance.expires_after(patience);
    last_chance.async_wait([this](boost::system::error_code error) {
      if (!error && finished) {
        log->warn("ending with an answer half written; the journal knows how to go on");
        std::exchange(finished, {})();
      }
    });
    carry_out(core.set_obstacle("the gateway is ending", moment_now()));
  }

  void carry_out(const fabric::ChannelKey& key, const Read& action) {
    links.at(key.machine).read(key.channel, action.look);
  }
  void carry_out(const fabric::ChannelKey& key, const Write& action) {
    links.at(key.machine).write(key.channel, action.variable, action.value);
  }
  void carry_out(const fabric::ChannelKey& key, const WakeAt& action) {
    asio::steady_timer& wake = wakes.try_emplace(key, executor).first->second;
    if (wake.expiry() == action.at) {
      return;
    }
    wake.expires_at(action.at);
    wake.async_wait([this, key](boost::system::error_code error) {
      if (!error) {
        carry_out(core.on_wake(key, moment_now()));
      }
    });
  }
  void carry_out(const fabric::ChannelKey& key, const Record& action) {
    journal->append(action.entry, [this, key, ticket = action.ticket] {
      carry_out(core.on_recorded(key, ticket, moment_now()));
    });
  }
  void carry_out(const fabric::ChannelKey& key, const Publish& action) {
    if (const auto published = call_end.publish(action.request); !published) {
      log->error("{}: call {} cannot be given out: {}", key.to_string(),
                 action.request.call.to_string(), published.error());
    }
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
  void carry_out(const fabric::ChannelKey& key, const Say& action) {
    log->log(level_of(action.level), "{}: {}", key.to_string(), action.text);
  }
  // The core keeps these to itself.
  void carry_out(const fabric::ChannelKey&, const Offer&) {}
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
        carry_out(core.on_time(moment_now()));
      }
    });
  }

  asio::any_io_executor executor;
  idl::program::Log log;
  std::unique_ptr<journal::Journal> journal;
  Core core;
  asio::steady_timer timer;
  std::optional<SteadyTime> armed;
  asio::steady_timer last_chance;
  std::function<void()> finished;
  std::map<fabric::ChannelKey, asio::steady_timer> wakes;
  fabric::Participant participant;
  fabric::CallEnd call_end;
  fabric::CommandEnd command_end;
  /// Names this gateway in the outcomes of commands.
  fabric::InstanceId id = fabric::InstanceId::random();
  std::map<std::string, MachineLink> links;
};

Gateway::Gateway(asio::any_io_executor executor, const Settings& settings, idl::program::Log log)
    : impl_(std::make_unique<Impl>(executor, settings, std::move(log))) {}

Gateway::~Gateway() = default;

void Gateway::finish(std::function<void()> finished) {
  impl_->finish(std::move(finished));
}

void Gateway::start() {
  for (auto& [name, link] : impl_->links) {
    link.start();
  }
}

}  // namespace millrace::gateway
