#include "tests/simulation/world.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "tests/simulation/faults/storm.hpp"

namespace millrace::tests::simulation {

namespace {

/// Once faults have stopped, everything open is answered within this.
constexpr Time recovery = 60s;
/// What comes late has come by then.
constexpr Time aftermath = 4s;

std::string uuid_number(std::size_t number) {
  return fmt::format("{:08x}-0000-4000-8000-00000000000{}", 0xa0000000U + number, number % 10);
}

}  // namespace

World::World(std::uint64_t seed, Options options)
    : seed_(seed),
      options_(std::move(options)),
      random_(Random(~seed).next()),
      history_(agenda_, options_.trace),
      fabric_(agenda_, history_, random_.fork()) {
  build();
  storm_ = std::make_unique<Storm>(*this, random_.fork());
}

World::~World() = default;

gateway::CoreOptions World::core_options() {
  gateway::CoreOptions options;
  gateway::Pace pace;
  pace.active = 4ms;
  pace.idle = std::chrono::milliseconds(10 + random_.below(40));
  for (const auto& controller : controllers_) {
    options.paces[controller->name()] = pace;
  }
  options.policies = policies_;
  return options;
}

void World::build() {
  build_services();
  const auto rule = [this](std::chrono::milliseconds least, std::uint32_t state) {
    return gateway::Rule{least + std::chrono::milliseconds(random_.below(2000)),
                         random_.chance(70) ? state : 0};
  };
  if (random_.chance(25)) {
    policies_.everywhere.deadline = rule(1000ms, 408);
  }
  if (random_.chance(25)) {
    policies_.everywhere.lost = rule(0ms, 410);
  }
  if (random_.chance(25)) {
    policies_.everywhere.refused = rule(0ms, 422);
  }
  if (random_.chance(25)) {
    policies_.everywhere.unserved = gateway::Rule{500ms, 404};
  }
  build_controllers();
  const std::size_t gateways = std::min<std::size_t>(controllers_.size(), 1 + random_.below(2));
  constexpr std::array policies{gateway::journal::Sync::never, gateway::journal::Sync::interval,
                                gateway::journal::Sync::always};
  for (std::size_t i = 0; i < gateways; ++i) {
    GatewayPlan plan;
    plan.number = i;
    plan.core = core_options();
    plan.journal.sync = random_.pick(policies);
    plan.journal.period = std::chrono::milliseconds(100 + random_.below(900));
    plan.journal.compact_at = 256U << random_.below(8);
    plan.in_memory = random_.chance(10);
    plan.bug = options_.bug;
    gateways_.push_back(std::make_unique<GatewayProcess>(plan, agenda_, ++parties_, history_,
                                                         fabric_, random_.fork()));
  }
  for (const auto& controller : controllers_) {
    auto cable = std::make_unique<Cable>();
    cable->shuffled = random_.chance(30);
    const std::size_t by = random_.below(gateways_.size());
    gateways_[by]->serve(*controller, *cable);
    served_by_.push_back(by);
    cables_.push_back(std::move(cable));
  }
}

void World::build_services() {
  const std::size_t count = 1 + random_.below(3);
  for (std::size_t i = 0; i < count; ++i) {
    ServicePlan plan;
    plan.uuid = uuid_number(i);
    uuids_.push_back(plan.uuid);
    plan.delivery =
        random_.chance(40) ? fabric::Delivery::at_most_once : fabric::Delivery::at_least_once;
    plan.concurrency = static_cast<std::uint32_t>(1 + random_.below(3));
    plan.habits.slow = static_cast<unsigned>(random_.below(40));
    plan.habits.fails = static_cast<unsigned>(random_.below(10));
    plan.habits.refused = random_.chance(20) ? 10 : 0;
    plan.habits.interim = static_cast<unsigned>(random_.below(50));
    plan.habits.stuck = random_.chance(20) ? 5 : 0;
    plan.bug = options_.bug;
    const std::size_t instances = 1 + random_.below(3);
    for (std::size_t one = 0; one < instances; ++one) {
      plan.name = fmt::format("service {}.{}", i, one);
      plan.channels.clear();
      if (one > 0 && random_.chance(30)) {
        plan.channels.push_back(
            {random_.chance(50) ? "m0" : "", static_cast<std::uint16_t>(random_.below(3))});
      }
      services_.push_back(std::make_unique<ServiceProcess>(plan, agenda_, ++parties_, history_,
                                                           fabric_, random_.fork()));
    }
  }
}

void World::build_controllers() {
  const std::size_t count = 1 + random_.below(3);
  for (std::size_t i = 0; i < count; ++i) {
    auto controller =
        std::make_unique<Controller>(fmt::format("m{}", i), ++parties_, agenda_, history_);
    const cnc::simulator::ServiceRules rules{.response_clears_request = random_.chance(50),
                                             .ads_request_clears_response = random_.chance(50),
                                             .reset_clears_states = random_.chance(50)};
    const std::size_t channels = 1 + random_.below(3);
    for (std::size_t channel = 0; channel < channels; ++channel) {
      ProgramHabits habits;
      habits.uuids = uuids_;
      if (policies_.everywhere.unserved && random_.chance(50)) {
        habits.uuids.push_back(uuid_number(9));
      }
      habits.calls = 5 + random_.below(30);
      habits.impatient = static_cast<unsigned>(random_.below(30));
      habits.repeats_itself = random_.chance(20) ? 20 : 0;
      habits.cycle = random_.between(100us, 4ms);
      habits.pause = random_.mostly(Time{}, 20ms, 400ms, 30);
      controller->add(rules, habits, random_.fork());
    }
    controllers_.push_back(std::move(controller));
  }
}

GatewayProcess& World::gateway_of(const Controller& controller) {
  const auto found =
      std::ranges::find(controllers_, &controller, &std::unique_ptr<Controller>::get);
  return *gateways_[served_by_[static_cast<std::size_t>(found - controllers_.begin())]];
}

Cable& World::cable_of(const Controller& controller) {
  const auto found =
      std::ranges::find(controllers_, &controller, &std::unique_ptr<Controller>::get);
  return *cables_[static_cast<std::size_t>(found - controllers_.begin())];
}

/// Starts again what has ended, as a supervisor does.
void World::supervise() {
  for (auto& gateway : gateways_) {
    if (!gateway->running()) {
      agenda_.after(random_.mostly(100ms, 300ms, 2000ms, 20), {}, [&gateway] { gateway->start(); });
    }
  }
  for (auto& service : services_) {
    if (calm_ && service->stuck()) {
      service->kill();
    }
    if (!service->running()) {
      agenda_.after(random_.mostly(10ms, 300ms, 2000ms, 20), {}, [&service] { service->start(); });
    }
  }
  agenda_.after(200ms, {}, [this] { supervise(); });
}

/// Looks at what waits for a decision, and decides.
void World::operate() {
  for (auto& gateway : gateways_) {
    if (!gateway->running() || gateway->frozen()) {
      continue;
    }
    const auto statuses = gateway->statuses();
    for (const auto& [key, status] : statuses) {
      const bool held = status.state == fabric::ChannelState::held;
      const bool meddles = !calm_ && random_.chance(1) && status.call != fabric::CallId{};
      if ((held && (calm_ || random_.chance(20))) || meddles) {
        random_.chance(50) ? gateway->answer(key, status.call) : gateway->retry(key, status.call);
      }
    }
  }
  agenda_.after(random_.between(50ms, 500ms), {}, [this] { operate(); });
}

/// A journal that lost its end may leave a program waiting that asks nothing any more, and so may
/// an interim answer that crossed its next request: whoever stands at the machine resets it.
void World::rescue() {
  for (auto& controller : controllers_) {
    const GatewayProcess& gateway = gateway_of(*controller);
    for (const std::uint16_t number : controller->numbers()) {
      const auto status = gateway.statuses().find({controller->name(), number});
      const bool excused = gateway.lost_memory() || controller->channel(number).crossed;
      if (excused && !controller->program(number).done() && status != gateway.statuses().end() &&
          status->second.state == fabric::ChannelState::idle) {
        controller->reset(number, 100ms);
      }
    }
  }
}

bool World::done() const {
  return std::ranges::all_of(controllers_, [](const auto& one) { return one->done(); }) &&
         std::ranges::all_of(
             gateways_, [](const auto& one) { return one->running() && one->open_calls() == 0; });
}

void World::judge_the_end() {
  for (const auto& controller : controllers_) {
    for (const std::uint16_t number : controller->numbers()) {
      if (!controller->program(number).done()) {
        const Key key{controller->name(), number};
        const auto& statuses = gateway_of(*controller).statuses();
        const auto status = statuses.find(key);
        history_.violated(fmt::format(
            "I5: {} still waits {} s after the last fault; its gateway says: {}", key.to_string(),
            std::chrono::duration_cast<std::chrono::seconds>(recovery).count(),
            status == statuses.end() ? "nothing" : status->second.reason));
      }
    }
  }
  for (std::size_t i = 0; i < gateways_.size(); ++i) {
    if (gateways_[i]->open_calls() > 0) {
      history_.violated(
          fmt::format("I5: gateway {} still has {} open calls", i, gateways_[i]->open_calls()));
    }
  }
}

Outcome World::run() {
  for (auto& service : services_) {
    agenda_.after(random_.between(Time{}, 300ms), {}, [&service] { service->start(); });
  }
  for (auto& gateway : gateways_) {
    agenda_.after(random_.between(Time{}, 300ms), {}, [&gateway] { gateway->start(); });
  }
  for (auto& controller : controllers_) {
    controller->start_programs();
  }
  agenda_.after(400ms, {}, [this] { supervise(); });
  operate();

  const Time storm = random_.between(1s, 8s);
  agenda_.after(100ms, {}, [this, storm] { storm_->begin(storm); });
  const auto go_on = [&](Time until) {
    while (history_.violations().empty() && agenda_.now() < until && agenda_.step()) {
    }
  };
  go_on(storm + 100ms);
  if (history_.violations().empty()) {
    storm_->end();
    calm_ = true;
    for (auto& service : services_) {
      service->calm_down();
    }
    const Time latest = agenda_.now() + recovery;
    agenda_.after(recovery / 2, {}, [this] { rescue(); });
    while (history_.violations().empty() && !done() && agenda_.now() < latest && agenda_.step()) {
    }
    if (history_.violations().empty()) {
      judge_the_end();
    }
    go_on(agenda_.now() + aftermath);
  }
  Outcome outcome{history_.violations(), agenda_.now(), 0};
  for (const auto& controller : controllers_) {
    for (const std::uint16_t number : controller->numbers()) {
      outcome.answered += controller->program(number).answered();
    }
  }
  return outcome;
}

}  // namespace millrace::tests::simulation
