#include "tools/bus/operator.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include "base/posix/system.hpp"
#include "fabric/dds/trust_watch.hpp"
#include "fabric/endpoints/command_endpoint.hpp"
#include "fabric/endpoints/discovery.hpp"
#include "fabric/endpoints/gateway_monitor.hpp"
#include "fabric/endpoints/variable_endpoints.hpp"
#include "fabric/participant_identity.hpp"
#include "fabric/registry/instance_registry.hpp"
#include "fabric/wire/subscription.hpp"
#include "fabric/wire/writer.hpp"
#include "tools/bus/snapshot.hpp"

namespace millrace::tools::bus {

namespace {

using Clock = std::chrono::steady_clock;

/// The command topic stores nothing for later readers, so a command is repeated.
constexpr auto repeat_after = std::chrono::milliseconds(100);

class CommandSender : public std::enable_shared_from_this<CommandSender>,
                      public fabric::endpoints::GatewayMonitorListener {
 public:
  CommandSender(fabric::dds::Participant& participant, const std::vector<fabric::Command>& commands)
      : participant_(participant),
        commands_(commands),
        writer_(participant, participant.options().fabric) {}

  void open(boost::asio::io_context& io) {
    post_.emplace(io.get_executor(), weak_from_this(), [this] { drain(); });
    discovery_.emplace(participant_, fabric::endpoints::Discovery::Of::tools, &*post_);
    gateways_.emplace(participant_, io.get_executor(), *this,
                      fabric::endpoints::GatewayMonitor::Of::all);
    outcomes_ = fabric::wire::Subscription<fabric::Outcome>(
        participant_, *post_, participant_.options().fabric,
        [this](const fabric::wire::Taken<fabric::Outcome>& taken) { take(taken); });
  }

  /// Sends what has no outcome yet.
  void send() {
    for (const fabric::Command& command : commands_) {
      if (!outcomes.contains(command.id)) {
        sent_.insert_or_assign(command.id, Clock::now());
        fabric::Command named = command;
        const auto& trust = participant_.options().trust;
        named.issuer = fabric::issuer_of(trust ? trust->name : std::string(), command.issuer);
        if (const auto written = writer_.write(named); !written) {
          throw std::runtime_error(written.error());
        }
      }
    }
  }

  [[nodiscard]] bool done() const { return outcomes.size() == commands_.size(); }

  std::map<fabric::InstanceId, CommandResult> outcomes;

 private:
  using Handle = dds_instance_handle_t;
  struct ReceivedOutcome {
    fabric::Outcome outcome;
    Handle participant = DDS_HANDLE_NIL;
    std::string program;
    Clock::time_point at;
  };

  /// An instance that was commanded to leave may be gone by now: its outcome comes before the news
  /// of that.
  void drain() {
    outcomes_.drain();
    judge_received();
    discovery_->drain(registry_, Clock::now());
    judge_received();
  }

  void take(const fabric::wire::Taken<fabric::Outcome>& taken) {
    // Far more than the receivers; a stranger can send any number.
    constexpr std::size_t most = 1024;
    if (taken.valid && sent_.contains(taken.value.command) && received_.size() < most) {
      received_.push_back({taken.value, outcomes_->participant_of(taken.writer),
                           outcomes_->program_of(taken.writer), Clock::now()});
    }
  }

  /// The publisher may become known only now.
  void on_machine(const fabric::MachineStatus& /*status*/) override { judge_received(); }
  void on_machine_gone(const std::string& /*machine*/, const fabric::InstanceId& /*gateway*/,
                       fabric::endpoints::Absence /*absence*/) override {}
  void on_channel(const fabric::ChannelStatus& /*status*/) override {}

  void judge_received() {
    for (const ReceivedOutcome& outcome : received_) {
      const auto command =
          std::ranges::find(commands_, outcome.outcome.command, &fabric::Command::id);
      if (is_asked(*command, outcome.participant)) {
        outcomes.try_emplace(command->id,
                             CommandResult{outcome.outcome, outcome.at - sent_.at(command->id),
                                           std::chrono::system_clock::now()});
      }
    }
  }

  [[nodiscard]] bool is_asked(const fabric::Command& command, Handle participant) const {
    return fabric::endpoints::is_for(participant, command, registry_, *gateways_);
  }

 public:
  /// Warns of outcomes from participants that did not get the command.
  void warn(const std::string& flags) const {
    std::set<std::string> answered;
    for (const ReceivedOutcome& outcome : received_) {
      const auto command =
          std::ranges::find(commands_, outcome.outcome.command, &fabric::Command::id);
      if (!is_asked(*command, outcome.participant) && answered.insert(outcome.program).second) {
        fmt::print(stderr,
                   "participant {} publishes the outcome of a command that was not for it; it is "
                   "ignored (`millrace doctor{}` lists the participants)\n",
                   outcome.program, flags);
      }
    }
  }

 private:
  fabric::dds::Participant& participant_;
  const std::vector<fabric::Command>& commands_;
  fabric::wire::Writer<fabric::Command> writer_;
  std::map<fabric::InstanceId, Clock::time_point> sent_;
  // Before the reader that wakes it.
  std::optional<fabric::dds::PostOnce> post_;
  std::optional<fabric::endpoints::Discovery> discovery_;
  std::optional<fabric::endpoints::GatewayMonitor> gateways_;
  fabric::wire::Subscription<fabric::Outcome> outcomes_;
  fabric::registry::InstanceRegistry registry_;
  std::vector<ReceivedOutcome> received_;
};

}  // namespace

std::map<fabric::InstanceId, CommandResult> issue(fabric::dds::Participant& participant,
                                                  const std::vector<fabric::Command>& commands,
                                                  std::chrono::milliseconds patience,
                                                  const std::string& flags) {
  boost::asio::io_context io{1};
  const auto work = boost::asio::make_work_guard(io);
  const auto sender = std::make_shared<CommandSender>(participant, commands);
  sender->open(io);
  const auto end = Clock::now() + patience;
  auto next_sending = Clock::now();
  while (!sender->done() && Clock::now() < end) {
    if (Clock::now() >= next_sending) {
      sender->send();
      next_sending = Clock::now() + repeat_after;
    }
    io.run_one_until(std::min(next_sending, end));
  }
  sender->warn(flags);
  return std::move(sender->outcomes);
}

std::string issuer_here() {
  const passwd* user = ::getpwuid(::geteuid());
  // At most 127 bytes fit.
  return fmt::format("{:.31}@{:.63}", user != nullptr ? user->pw_name : "unknown",
                     base::posix::host_name());
}

namespace {

/// A gateway may be discovered only now, or take the channel over from another one.
constexpr auto ask_again_after = std::chrono::milliseconds(200);
/// How often a gateway is searched until one is discovered.
constexpr auto look_after = std::chrono::milliseconds(5);

}  // namespace

struct VariableClient::Impl : fabric::endpoints::GatewayMonitorListener {
  Impl(fabric::dds::Participant& own_participant, fabric::ChannelKey own_key,
       std::chrono::milliseconds own_patience, std::string own_flags)
      : participant(own_participant),
        key(std::move(own_key)),
        patience(own_patience),
        flags(std::move(own_flags)),
        end(participant, io.get_executor(),
            [this](const fabric::VariableReply& received) {
              if (received.token == token) {
                reply = received;
              }
            }),
        gateways(participant, io.get_executor(), *this,
                 fabric::endpoints::GatewayMonitor::Of::all) {}

  void on_machine(const fabric::MachineStatus& status) override {
    if (machines.insert(status.machine).second) {
      discovery.on_news(Clock::now());
    }
  }
  void on_machine_gone(const std::string& /*machine*/, const fabric::InstanceId& /*gateway*/,
                       fabric::endpoints::Absence /*absence*/) override {}
  void on_channel(const fabric::ChannelStatus& /*status*/) override {}

  /// Gateways serve other machines, and each had the time to publish its own.
  [[nodiscard]] bool is_unknown(Clock::time_point now) const {
    return !machines.empty() && !machines.contains(key.machine) &&
           now >= discovery.end(participant.options().trust != nullptr);
  }

  /// The gateway that got the write request is gone: the outcome is unknown, and another gateway
  /// must not write again.
  [[nodiscard]] bool lost(const fabric::VariableRequest& request, std::size_t most) const {
    return request.action == fabric::VariableAction::write && end.gateways() < most;
  }

  [[nodiscard]] std::string unanswered(const fabric::VariableRequest& request, std::size_t most,
                                       bool refused) const {
    const std::string where = fmt::format("fabric '{}', domain {}", participant.options().fabric,
                                          participant.options().domain);
    const bool writes = request.action == fabric::VariableAction::write;
    const std::string unknown = writes ? "; it may or may not be written; read it" : "; ask again";
    if (!machines.empty() && !machines.contains(key.machine)) {
      return fmt::format("no machine '{}' on {}; known: {}", key.machine, where,
                         fmt::join(machines, ", "));
    }
    if (refused || end.gateways() < most) {
      return "a gateway that got the request is gone" + unknown;
    }
    if (most == 0) {
      return fmt::format(
          "no gateway on {} takes variable requests; 'millrace machines{}' lists the gateways, and "
          "--direct asks the controller itself",
          where, flags);
    }
    return fmt::format(
        "no gateway on {} has answered for {} within {} ms: it does not serve that machine or "
        "channel, or hangs; 'millrace machines{}' lists the machines{}",
        where, key.to_string(), patience.count(), flags, writes ? unknown : "");
  }

  fabric::dds::Participant& participant;
  fabric::ChannelKey key;
  std::chrono::milliseconds patience;
  std::string flags;
  boost::asio::io_context io{1};
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> work =
      boost::asio::make_work_guard(io);
  fabric::InstanceId token{};
  std::optional<fabric::VariableReply> reply;
  fabric::endpoints::VariableRequestEndpoint end;
  /// Of all gateways.
  std::set<std::string> machines;
  ListeningTime discovery{Patience{}, Clock::now()};
  fabric::endpoints::GatewayMonitor gateways;
};

VariableClient::VariableClient(fabric::dds::Participant& participant, fabric::ChannelKey key,
                               std::chrono::milliseconds patience, std::string flags)
    : impl_(std::make_unique<Impl>(participant, std::move(key), patience, std::move(flags))) {}

VariableClient::~VariableClient() = default;

tl::expected<fabric::VariableReply, std::string> VariableClient::ask(
    fabric::VariableRequest request) {
  Impl& self = *impl_;
  self.token = fabric::InstanceId::random();
  self.reply.reset();
  request.requester = self.end.id();
  request.token = self.token;
  request.key = self.key;
  request.patience = self.patience;
  request.issuer = issuer_here();
  request.at = std::chrono::system_clock::now();
  const auto end = Clock::now() + self.patience;
  std::optional<Clock::time_point> first_said;
  auto next_sending = Clock::now();
  // The largest number of gateways that may have received it at once.
  std::size_t most = 0;
  while (!self.reply && Clock::now() < end && !self.lost(request, most) &&
         !self.is_unknown(Clock::now())) {
    const auto now = Clock::now();
    const std::size_t there = self.end.gateways();
    if (there > most || (there > 0 && now >= next_sending)) {
      most = std::max(most, there);
      next_sending = now + ask_again_after;
      request.age = now - first_said.value_or(now);
      first_said = first_said.value_or(now);
      if (const auto published = self.end.publish(request); !published) {
        return tl::unexpected(published.error());
      }
    }
    const auto due = std::min(end, there == 0 ? now + look_after : next_sending);
    self.io.run_one_until(due);
    self.discovery.on_timer(due, Clock::now());
  }
  if (!self.reply) {
    return tl::unexpected(self.unanswered(request, most, self.lost(request, most)));
  }
  return std::move(*self.reply);
}

}  // namespace millrace::tools::bus
