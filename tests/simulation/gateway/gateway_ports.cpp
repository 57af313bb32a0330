// The outputs of a gateway.
#include <algorithm>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "gateway/machines/controller.hpp"
#include "tests/simulation/gateway/ads_link.hpp"
#include "tests/simulation/gateway/gateway_process.hpp"

namespace millrace::tests::simulation {
namespace queues = gateway::queues;
using gateway::WriteOutcome;

// The link from a gateway to a message queue, over the connection to its controller.

class RingLink {
 public:
  /// `events` outlives it.
  RingLink(Process& process, GatewayNumber gateway, std::weak_ptr<AdsLink> link, MessageRing& ring,
           Key queue, gateway::machines::ControllerEvents& events, Random random);
  ~RingLink();
  RingLink(const RingLink&) = delete;
  RingLink& operator=(const RingLink&) = delete;

  void ask(const gateway::queues::Step& step);
  void watch();

 private:
  Process& process_;
  GatewayNumber gateway_;
  std::weak_ptr<AdsLink> link_;
  MessageRing& ring_;
  Key queue_;
  gateway::machines::ControllerEvents& events_;
  Random random_;
  /// The delay of notifications; some changes are not notified at all.
  Time late_;
  unsigned lost_;
  std::shared_ptr<int> life_ = std::make_shared<int>(0);
};

namespace {

queues::StepAnswer done_by(MessageRing& ring, const queues::Step& step, GatewayNumber gateway) {
  if (std::holds_alternative<queues::ReadControl>(step)) {
    return queues::Answer<queues::Control>(ring.control());
  }
  if (std::holds_alternative<queues::ReadQueue>(step)) {
    return queues::Answer<std::vector<std::string>>(ring.texts());
  }
  ring.write_last_get(std::get<queues::WriteLastGet>(step).element, gateway);
  return queues::Answer<void>();
}

queues::StepAnswer refusal_of(const queues::Step& step, const std::string& reason) {
  if (std::holds_alternative<queues::ReadControl>(step)) {
    return queues::Answer<queues::Control>(tl::unexpected(reason));
  }
  if (std::holds_alternative<queues::ReadQueue>(step)) {
    return queues::Answer<std::vector<std::string>>(tl::unexpected(reason));
  }
  return queues::Answer<void>(tl::unexpected(reason));
}

}  // namespace

RingLink::RingLink(Process& process, GatewayNumber gateway, std::weak_ptr<AdsLink> link,
                   MessageRing& ring, Key queue, gateway::machines::ControllerEvents& events,
                   Random random)
    : process_(process),
      gateway_(gateway),
      link_(std::move(link)),
      ring_(ring),
      queue_(std::move(queue)),
      events_(events),
      random_(random),
      late_(random_.mostly(1ms, 20ms, 500ms, 20)),
      lost_(static_cast<unsigned>(random_.below(30))) {
  ring_.connected(gateway);
}

RingLink::~RingLink() {
  ring_.watchers.erase(this);
}

void RingLink::ask(const queues::Step& step) {
  const auto link = link_.lock();
  if (!link) {
    return;
  }
  struct Found {
    queues::StepAnswer answer;
    MessageRing::Sight sight;
  };
  const auto found = std::make_shared<Found>();
  link->ask({.carry_out =
                 [&ring = ring_, gateway = gateway_, step, found] {
                   found->answer = done_by(ring, step, gateway);
                   found->sight = ring.sight(gateway);
                 },
             .on_answer =
                 [this, &ring = ring_, gateway = gateway_, step, found,
                  alive = std::weak_ptr(life_)](const std::string& failure) {
                   if (!failure.empty()) {
                     found->answer = refusal_of(step, failure);
                   } else if (std::holds_alternative<queues::ReadControl>(step)) {
                     ring.seen(gateway, found->sight);
                   }
                   if (!alive.expired()) {
                     // The event may destroy this object, if the gateway has stood still.
                     events_.on_queue_answer(Key(queue_), std::move(found->answer));
                   }
                 }});
}

void RingLink::watch() {
  ring_.watchers[this] = [this] {
    if (!random_.chance(lost_)) {
      process_.after(random_.between(Time{}, late_), [this, alive = std::weak_ptr(life_)] {
        if (!alive.expired()) {
          events_.on_queue_event(Key(queue_));
        }
      });
    }
  };
}

/// A gateway's reference to its link; the place of some mistakes.
class GatewayProcess::WatchedLink final : public gateway::machines::Controller {
 public:
  WatchedLink(GatewayProcess& process, std::string machine, std::shared_ptr<AdsLink> link)
      : process_(process), machine_(std::move(machine)), link_(std::move(link)) {}
  ~WatchedLink() override { link_->abandon(); }
  WatchedLink(const WatchedLink&) = delete;
  WatchedLink& operator=(const WatchedLink&) = delete;

  void read(std::uint16_t channel, gateway::ReadSet set) override {
    const Key key{machine_, channel};
    if (auto made_up = process_.mistakes_.instead_of(key, set, process_.checker_)) {
      process_.process().after(Time{}, [&process = process_, key, snapshot = *std::move(made_up)] {
        process.core_->on_read(key, snapshot);
      });
      return;
    }
    link_->read(channel, set);
  }
  void write(std::uint16_t channel, gateway::Variable variable,
             const gateway::Value& value) override {
    const Key key{machine_, channel};
    if (process_.mistakes_.keeps(key, {variable, value}, process_.checker_)) {
      process_.process().after(
          Time{}, [&process = process_, key] { process.on_write(key, WriteOutcome::written, ""); });
      return;
    }
    process_.checker_.on_write(key, variable, value);
    link_->write(channel, variable, value);
  }
  void subscribe(const std::vector<std::uint16_t>& channels) override {
    link_->subscribe(channels);
  }
  void unsubscribe(const std::vector<std::uint16_t>& channels) override {
    link_->unsubscribe(channels);
  }
  void ask(const gateway::machines::Question& question) override {
    ValueStore& values = process_.plugged_.at(machine_).controller->values();
    struct Made {
      gateway::machines::Answer answer;
      Time at{};
    };
    const auto made = std::make_shared<Made>();
    const bool twice = process_.mistakes_.makes(Bug::value_written_twice);
    link_->ask({.carry_out =
                    [&values, &process = process_, question, made, twice] {
                      made->at = process.process().agenda().now();
                      made->answer = values.answer(question);
                      if (twice) {
                        made->answer = values.answer(question);
                      }
                    },
                .on_answer =
                    [&values, &process = process_, machine = machine_, question,
                     made](const std::string& failure) {
                      if (failure.empty()) {
                        values.on_answer_arrived(made->at);
                      } else {
                        made->answer = ValueStore::failure(question, cnc::ads::ErrorCode::timeout);
                      }
                      process.on_answer(machine,
                                        process.mistakes_.taken_for(machine, made->answer));
                    }});
  }
  void open(const Key& queue, const gateway::queues::QueueSettings& settings) override {
    queues_.erase(queue);
    queues_.try_emplace(queue, process_.process(), process_.plan_.number, link_,
                        process_.plugged_.at(machine_).controller->queue(settings.name), queue,
                        process_, process_.random_.fork());
  }
  void ask(const Key& queue, const gateway::queues::Step& step) override {
    if (const auto* const write = std::get_if<gateway::queues::WriteLastGet>(&step)) {
      process_.checker_.on_last_get(queue, write->element);
    }
    queues_.at(queue).ask(step);
  }
  void subscribe(const Key& queue) override { queues_.at(queue).watch(); }
  [[nodiscard]] gateway::machines::LinkLoad load() const override { return {}; }

 private:
  GatewayProcess& process_;
  std::string machine_;
  std::shared_ptr<AdsLink> link_;
  std::map<Key, RingLink> queues_;
};

/// The core, and the requests that the gateway shows it for message queues.
class GatewayProcess::WatchedCore final : public gateway::core::Core {
 public:
  WatchedCore(GatewayProcess& process, gateway::core::CoreOptions options,
              const gateway::journal::JournalState& journal_state)
      : Core(process, process, std::move(options), journal_state), process_(process) {}

 private:
  /// The Service Interface of queues.
  class WatchedAccess final : public gateway::ServiceAccess {
   public:
    explicit WatchedAccess(WatchedCore& core) : core_(core) {}
    void read(const Key& key, gateway::ReadSet set) override {
      core_.Core::access_of(key).read(key, set);
    }
    void write(const Key& key, const gateway::Write& write, gateway::Moment now) override {
      GatewayChecker& checker = core_.process_.checker_;
      checker.on_write(key, write.variable, write.value);
      core_.Core::access_of(key).write(key, write, now);
      checker.on_window_written(key, write.variable, write.value, core_.queue_snapshot(key));
    }
    void on_over(const Key& key) override { core_.Core::access_of(key).on_over(key); }

   private:
    WatchedCore& core_;
  };

  gateway::ServiceAccess& access_of(const Key& key) override {
    return fabric::queue_of(key.machine).empty() ? Core::access_of(key) : queues_;
  }
  void read_channel(const Key& key, const gateway::ServiceSnapshot& snapshot) override {
    if (!fabric::queue_of(key.machine).empty()) {
      GatewayChecker& checker = process_.checker_;
      checker.on_shown(key, queue_snapshot(key));
      process_.history().add(SnapshotRead{process_.plan_.number, checker.seen_as(key), snapshot,
                                          process_.Member::now()});
    }
    Core::read_channel(key, snapshot);
  }

  void on_serve(const std::string& machine, const std::vector<std::uint16_t>& channels) override {
    process_.served_no_more(machine);
    for (const std::uint16_t channel : channels) {
      process_.served_.insert({machine, channel});
    }
    process_.note(fmt::format("serves {} channels of {}", channels.size(), machine));
    Core::on_serve(machine, channels);
  }
  void on_lost(const std::string& machine, const fabric::Message& reason) override {
    process_.served_no_more(machine);
    Core::on_lost(machine, reason);
  }
  void on_link_dropped(const std::string& machine, const fabric::Message& reason) override {
    // Also a channel that it had left and whose answer it finished.
    process_.leaves_all_of(machine);
    process_.note(fmt::format("drops its link to {}: {}", machine, reason));
    Core::on_link_dropped(machine, reason);
  }
  void on_channel_removed(const Key& key) override {
    process_.leaves(key);
    Core::on_channel_removed(key);
  }
  void on_not_owner(const Key& key, const fabric::Message& reason) override {
    process_.leaves(key);
    process_.checker_.on_not_owner(key);
    Core::on_not_owner(key, reason);
  }

  GatewayProcess& process_;
  WatchedAccess queues_{*this};
};

std::unique_ptr<gateway::core::Core> GatewayProcess::make_core(
    const gateway::core::GatewayIdentity& own) {
  return std::make_unique<WatchedCore>(
      *this,
      gateway::core::CoreOptions{.own = own,
                                 .lease = fabric().conditions.lease,
                                 .machines = plan_.file.machines,
                                 .policies = plan_.file.policies},
      journal_writer_->state());
}

void GatewayProcess::publish(const fabric::Request& request) {
  checker_.on_publish(request);
  // The endpoint publishes what waits before an at-most-once request; it can only do so if the
  // status is there by then.
  if (const auto status = statuses_.find(request.key);
      status == statuses_.end() || status->second.call != request.call) {
    history().violated(fmt::format("{} is dispatched before other gateways can know of it",
                                   request.call.to_string()));
  }
  if (!fabric().publish(*end(), request)) {
    history().violated(fmt::format("{} cannot be dispatched: no writer", request.call.to_string()));
  }
}

void GatewayProcess::publish(const fabric::Event& event) {
  checker_.on_tell(event.key, event, in_trouble_, ending_);
}

void GatewayProcess::publish(const fabric::ChannelStatus& status) {
  statuses_[status.key] = status;
  fabric().gateway_topics().publish(*end(), status);
}

void GatewayProcess::publish(const fabric::MachineStatus& status) {
  fabric().gateway_topics().publish(*end(), status);
}

void GatewayProcess::publish(const fabric::DataSample& sample) {
  if (on_sample && fabric::queue_of(sample.key.machine).empty()) {
    on_sample(sample, process().stood_still(std::chrono::seconds(3)));
  }
}

void GatewayProcess::publish(const fabric::InstanceId&, const fabric::VariableReply& reply) {
  if (on_variable_reply) {
    on_variable_reply(reply);
  }
}

void GatewayProcess::dispose(const fabric::RequestKey& request) {
  checker_.on_dispose(request);
  fabric().withdraw(*end(), request);
}

void GatewayProcess::dispose(const Key& status) {
  statuses_.erase(status);
  fabric().gateway_topics().let_go(*end(), status);
}

void GatewayProcess::dispose(const fabric::MachineStatus& status) {
  fabric().gateway_topics().let_go(*end(), status.machine);
}

void GatewayProcess::subscribe_channels() {
  fabric().gateway_topics().subscribe_channels(*end());
}

gateway::Moment GatewayProcess::now() const {
  return {gateway::SteadyTime(booted_ + Member::now()), wall()};
}

void GatewayProcess::wake_at(std::optional<gateway::SteadyTime> time) {
  const std::uint64_t number = ++wakes_;
  if (time) {
    process().timer(std::max(Time(*time - now().steady), Time{}), [this, number] {
      if (number == wakes_) {
        core_->on_time();
      }
    });
  }
}

std::unique_ptr<gateway::machines::Controller> GatewayProcess::connect(
    const gateway::settings::MachineSettings& machine) {
  const Machine& there = plugged_.at(machine.name);
  auto link =
      std::make_shared<AdsLink>(process(), plan_.number, *there.controller, *there.conditions,
                                machine.channels, *this, *this, history(), random_.fork());
  links_[machine.name] = link;
  link->start();
  return std::make_unique<WatchedLink>(*this, machine.name, std::move(link));
}

void GatewayProcess::append(const gateway::JournalEntry& entry, const gateway::Ticket& ticket) {
  checker_.on_record(entry, ticket);
  if (mistakes_.skips(entry)) {
    process().after(Time{}, [this, ticket] { on_recorded(ticket); });
  } else if (mistakes_.makes(Bug::recorded_before_forced)) {
    journal_writer_->append(entry, {});
    process().after(Time{}, [this, ticket] { on_recorded(ticket); });
  } else {
    journal_writer_->append(entry, ticket);
  }
}

void GatewayProcess::on_recorded(const gateway::Ticket& ticket) {
  if (ticket) {
    checker_.on_recorded(ticket);
    core_->on_recorded(ticket);
  }
}

void GatewayProcess::log(gateway::Level, const std::string& text) {
  // A repeated dispatch is reported before anything results from it.
  if (const auto call = std::exchange(retrying_, {}); call != fabric::CallId{}) {
    checker_.on_retried(call);
  }
  note(text);
}

void GatewayProcess::set_alarm(const fabric::AlarmKey& key, const fabric::Message& text,
                               const fabric::Message&) {
  note(fmt::format("alarm {} {}: {}", key.kind, key.subject, text));
}

void GatewayProcess::served_no_more(const std::string& machine) {
  std::erase_if(served_, [&](const Key& key) { return key.machine == machine; });
}

void GatewayProcess::leaves_all_of(const std::string& machine) {
  if (const auto plugged = plugged_.find(machine); plugged != plugged_.end()) {
    for (const std::uint16_t channel : plugged->second.controller->numbers()) {
      leaves({machine, channel});
    }
  }
}

void GatewayProcess::leaves(const Key& key) {
  served_.erase(key);
  ++times_left_[key];
  if (const auto machine = plugged_.find(key.machine); machine != plugged_.end()) {
    machine->second.controller->channel(key.channel).left_by(plan_.number);
  }
}

void GatewayProcess::may_end(bool half_written) {
  process().after(Time{}, [this, half_written] {
    core_->end();
    note(half_written ? "ends with an answer half written" : "has ended");
    leave(true);
    forget();
  });
}

}  // namespace millrace::tests::simulation
