#include "tests/simulation/plant.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

namespace millrace::tests::simulation {

namespace {

std::string uuid_number(std::size_t number) {
  return fmt::format("{:08x}-0000-4000-8000-00000000000{}", 0xa0000000U + number, number % 10);
}

}  // namespace

Plant::Plant(Agenda& agenda, History& history, Random random, Bug bug, Limits limits)
    : agenda_(agenda),
      history_(history),
      random_(random),
      bug_(bug),
      limits_(std::move(limits)),
      fabric_(agenda, random_.fork()) {
  build_services();
  policies_ = draw_policies(random_);
  build_controllers();
  build_queues();
  build_gateways();
  if (random_.chance(30)) {
    stranger_ = std::make_unique<Stranger>(random_.pick(uuids_), agenda_, ++parties_, history_,
                                           fabric_, random_.fork());
  }
}

gateway::Policies Plant::draw_policies(Random& random) {
  // Each configuration has different states, so that an answer shows which one it belongs to.
  const std::uint32_t base = 10'000 * ++policies_drawn_;
  const auto rule = [&](std::chrono::milliseconds least, std::uint32_t state) {
    return gateway::Rule{least + std::chrono::milliseconds(random.below(2000)),
                         random.chance(70) ? base + state : 0};
  };
  gateway::Policies policies;
  if (random.chance(25)) {
    policies.everywhere.deadline = rule(1000ms, 408);
  }
  if (random.chance(25)) {
    policies.everywhere.lost = rule(0ms, 410);
  }
  if (random.chance(25)) {
    policies.everywhere.refused = rule(0ms, 422);
  }
  if (random.chance(25)) {
    policies.everywhere.unserved = gateway::Rule{500ms, base + 404};
  }
  return policies;
}

void Plant::build_services() {
  const std::size_t count = 1 + random_.below(3);
  for (std::size_t i = 0; i < count; ++i) {
    ServicePlan plan;
    plan.uuid = uuid_number(i);
    plan.completion_signal = draw_completion_signal(i);
    (plan.completion_signal == fabric::CompletionSignal::response ? text_uuids_ : uuids_)
        .push_back(plan.uuid);
    plan.delivery =
        random_.chance(40) ? fabric::Delivery::at_most_once : fabric::Delivery::at_least_once;
    plan.concurrency = static_cast<std::uint32_t>(1 + random_.below(3));
    // Heartbeats show a gateway that its call is gone, for any reason.
    plan.heartbeats = random_.chance(80) && bug_ != Bug::withdraws_for_others;
    plan.behaviour.slow = static_cast<unsigned>(random_.below(40));
    plan.behaviour.fails = static_cast<unsigned>(random_.below(10));
    plan.behaviour.refused = random_.chance(30) ? 10 : 0;
    plan.behaviour.interim = static_cast<unsigned>(random_.below(50));
    plan.behaviour.stuck = random_.chance(20) ? 5 : 0;
    plan.behaviour.obeys = static_cast<unsigned>(random_.below(101));
    plan.foreign = random_.chance(20);
    plan.counts_no_attempts = random_.chance(30);
    plan.bug = bug_;
    const std::size_t instances = 1 + random_.below(3);
    for (std::size_t instance = 0; instance < instances; ++instance) {
      plan.name = fmt::format("service {}.{}", i, instance);
      plan.channels.clear();
      if (instance > 0 && random_.chance(30)) {
        plan.channels.push_back(
            {random_.chance(50) ? "m0" : "", static_cast<std::uint16_t>(random_.below(3))});
      }
      services_.push_back(std::make_unique<ServiceProcess>(plan, agenda_, ++parties_, history_,
                                                           fabric_, random_.fork()));
    }
  }
}

/// A separate random source, so that the rest of a seed keeps its meaning.
fabric::CompletionSignal Plant::draw_completion_signal(std::size_t service) const {
  Random random(~random_.state());
  return service > 0 && random.chance(30) ? fabric::CompletionSignal::response
                                          : fabric::CompletionSignal::response_state;
}

/// Programs that wait for RESPONSE alone, and call services that know it.
void Plant::let_wait_for_text(ProgramBehaviour& behaviour) const {
  Random random(~random_.state());
  if (!text_uuids_.empty() && !behaviour.interpreted && random.chance(60)) {
    behaviour.uuids = text_uuids_;
    behaviour.waits_for_text = true;
    behaviour.services_know = true;
  }
}

/// What is rare in most histories happens always in some. A separate random source, as above.
void Plant::exaggerate(ProgramBehaviour& behaviour) const {
  Random random(~random_.state() ^ 0x5a3a11fa11c0ffeeU);
  if (random.chance(15)) {
    behaviour.impatient = static_cast<unsigned>(50 + random.below(51));
    behaviour.patience = random.mostly(2ms, 30ms, 300ms, 30);
  }
  if (random.chance(15)) {
    behaviour.repeats_itself = static_cast<unsigned>(50 + random.below(51));
  }
  if (random.chance(20) && !behaviour.waits_for_text) {
    behaviour.changes = static_cast<unsigned>(10 + random.below(91));
  }
  if (random.chance(15)) {
    behaviour.pause = Time{};
  }
}

void Plant::build_controllers() {
  const std::size_t count = 1 + random_.below(3);
  for (std::size_t i = 0; i < count; ++i) {
    auto controller =
        std::make_unique<Controller>(fmt::format("m{}", i), ++parties_, agenda_, history_);
    cnc::simulator::ServiceRules rules{.response_clears_request = random_.chance(50),
                                       .ads_request_clears_response = random_.chance(50),
                                       .reset_clears_states = random_.chance(50),
                                       .start_clears_states = random_.chance(30)};
    let_kernel_clear(rules);
    const std::size_t channels = 1 + random_.below(3);
    for (std::size_t channel = 0; channel < channels; ++channel) {
      ProgramBehaviour behaviour;
      behaviour.uuids = uuids_;
      if (policies_.everywhere.unserved && random_.chance(50)) {
        behaviour.uuids.push_back(uuid_number(9));
      }
      behaviour.calls = 5 + random_.below(30);
      behaviour.impatient = static_cast<unsigned>(random_.below(30));
      behaviour.repeats_itself = random_.chance(20) ? 20 : 0;
      behaviour.cycle = random_.between(100us, 4ms);
      behaviour.pause = random_.mostly(Time{}, 20ms, 400ms, 30);
      behaviour.interpreted = random_.chance(30);
      behaviour.waits_for_text = !behaviour.interpreted && random_.chance(15);
      behaviour.waits_for_the_request = bug_ == Bug::cycle_waits_for_the_request;
      let_wait_for_text(behaviour);
      if (rules.kernel_clears_after && behaviour.waits_for_text) {
        // Such a kernel clears REQUEST_STATE only after RESPONSE_STATE ≠ 0.
        behaviour.waits_for_text = false;
        behaviour.services_know = false;
        behaviour.uuids = uuids_;
      }
      exaggerate(behaviour);
      if (limits_.quiet.contains(fmt::format("m{}/{}", i, channel + 1))) {
        behaviour.calls = 0;
      }
      controller->add(rules, behaviour, random_.fork());
    }
    link_conditions_.push_back(std::make_unique<LinkConditions>());
    link_conditions_.back()->notifications = draw_notifications();
    link_conditions_.back()->writes = draw_writes();
    controllers_.push_back(std::move(controller));
  }
}

/// A separate random source, so that the rest of a seed keeps its meaning.
void Plant::build_queues() {
  Random random(~random_.state() ^ 0x51ed270b76a1e4c3U);
  if (!random.chance(40)) {
    return;
  }
  const std::size_t count = 1 + random.below(2);
  for (std::size_t i = 0; i < count; ++i) {
    Controller& controller = *random.pick(controllers_);
    RingPlan plan;
    auto& settings = plan.settings;
    settings.name = fmt::format("q{}", i);
    settings.channel = static_cast<std::uint16_t>(1 + random.below(controller.size()));
    settings.array = "SD.Q";
    settings.uuid = random.pick(random.chance(20) && !text_uuids_.empty() ? text_uuids_ : uuids_);
    settings.acknowledge = random.chance(50) ? gateway::queues::Acknowledge::when_journalled
                                             : gateway::queues::Acknowledge::when_answered;
    settings.period = std::chrono::milliseconds(2 + random.below(40));
    settings.backlog = random.chance(50) ? 1 + random.below(10) : 10'000;
    settings.events = random.chance(50);
    plan.elements = static_cast<std::uint32_t>(3 + random.below(5));
    plan.messages = 5 + random.below(40);
    plan.pause = random.mostly(Time{}, 50ms, 400ms, 30);
    plan.cycle = random.between(100us, 4ms);
    plan.initialises = random.chance(30) ? 1 + static_cast<unsigned>(random.below(10)) : 0;
    plan.read_by_others = random.chance(20) ? 1 + static_cast<unsigned>(random.below(20)) : 0;
    plan.repeats = random.chance(15);
    plan.keeps = random.chance(60);
    const Key key = settings.key(controller.name());
    if (limits_.quiet.contains(key.to_string())) {
      plan.messages = 0;
    }
    history_.add(QueuePlanned{
        key, settings.acknowledge == gateway::queues::Acknowledge::when_answered, plan.repeats});
    controller.add_queue(std::move(plan), random.fork());
  }
}

/// A separate random source, so that the rest of a seed keeps its meaning.
NotificationBehaviour Plant::draw_notifications() const {
  Random random(~random_.state());
  NotificationBehaviour behaviour;
  behaviour.refuses = random.chance(20);
  behaviour.silent = random.chance(5);
  behaviour.first_only = random.chance(10);
  behaviour.lost = random.chance(30) ? static_cast<unsigned>(random.below(40)) : 0;
  behaviour.dropped = random.chance(20) ? 3 : 0;
  behaviour.late = random.chance(20) ? random.between(Time{}, 300ms) : Time{};
  behaviour.cycle = random.between(250us, 4ms);
  return behaviour;
}

/// A separate random source, so that the rest of a seed keeps its meaning. Half of the controllers
/// apply writes up to 50 ms after they have acknowledged them.
WriteBehaviour Plant::draw_writes() const {
  Random random(~random_.state() ^ 0x1a7e3417c0de5eedU);
  WriteBehaviour behaviour;
  if (random.chance(50)) {
    const bool all_alike = random.chance(50);
    behaviour.response = random.between(Time{}, 50ms);
    behaviour.request_state = all_alike ? behaviour.response : random.between(Time{}, 50ms);
    behaviour.response_state = all_alike ? behaviour.response : random.between(Time{}, 50ms);
  }
  behaviour.lost = random.chance(10) ? 1 + static_cast<unsigned>(random.below(10)) : 0;
  return behaviour;
}

void Plant::let_kernel_clear(cnc::simulator::ServiceRules& rules) const {
  Random random(~random_.state() ^ 0xc1ea45e1f0000001U);
  if (random.chance(15)) {
    rules.response_clears_request = false;
    rules.kernel_clears_after = random.chance(30) ? Time{} : random.between(Time{}, 50ms);
  }
}

gateway::settings::MachineSettings Plant::settings_of(const Controller& controller) {
  gateway::settings::MachineSettings settings;
  settings.name = controller.name();
  settings.intervals.active = 4ms;
  Random random(~random_.state());
  constexpr std::array modes{gateway::SubscriptionMode::automatic,
                             gateway::SubscriptionMode::notify, gateway::SubscriptionMode::poll};
  settings.watch = random.pick(modes);
  settings.intervals.idle = std::chrono::milliseconds(10 + random_.below(40));
  settings.intervals.kernel_clears_request_state = controller.kernel_clears() && random.chance(70);
  settings.variables.writable = {{"V.E.*"}};
  if (random.chance(30)) {
    settings.data.groups = {{.name = "clock",
                             .names = {"V.E.TIME"},
                             .period = std::chrono::milliseconds(10 + random.below(200))}};
  }
  for (const auto& ring : controller.queues()) {
    settings.queues.push_back(ring->plan().settings);
  }
  return settings;
}

void Plant::build_gateways() {
  // Each machine has one gateway, and some have a second one on standby.
  const std::size_t count = 1 + random_.below(std::min<std::size_t>(controllers_.size() + 1, 3));
  std::vector<GatewayPlan> plans(count);
  const bool stand_by = count > 1 && random_.chance(50);
  for (const auto& controller : controllers_) {
    const std::size_t first = random_.below(count);
    plans[first].file.machines.push_back(settings_of(*controller));
    if (stand_by && random_.chance(70)) {
      plans[(first + 1) % count].file.machines.push_back(settings_of(*controller));
    }
  }
  constexpr std::array policies{gateway::journal::Sync::never, gateway::journal::Sync::interval,
                                gateway::journal::Sync::always};
  for (std::size_t i = 0; i < count; ++i) {
    GatewayPlan& plan = plans[i];
    plan.number = i;
    plan.file.policies = policies_;
    plan.journal.sync = random_.pick(policies);
    plan.journal.period = std::chrono::milliseconds(100 + random_.below(900));
    plan.journal.compact_at = 256U << random_.below(8);
    plan.in_memory = random_.chance(10);
    plan.bug = bug_;
    first_files_.push_back(plan.file);
    gateways_.push_back(std::make_unique<GatewayProcess>(plan, agenda_, ++parties_, history_,
                                                         fabric_, random_.fork()));
    for (const auto& controller : controllers_) {
      gateways_.back()->plug(*controller, conditions_of(*controller));
    }
  }
}

LinkConditions& Plant::conditions_of(const Controller& controller) {
  const auto found =
      std::ranges::find(controllers_, &controller, &std::unique_ptr<Controller>::get);
  return *link_conditions_[static_cast<std::size_t>(found - controllers_.begin())];
}

std::vector<GatewayProcess*> Plant::gateways_of(const Controller& controller) {
  std::vector<GatewayProcess*> found;
  for (const auto& gateway : gateways_) {
    const auto& machines = first_file(*gateway).machines;
    if (std::ranges::find(machines, controller.name(), &gateway::settings::MachineSettings::name) !=
        machines.end()) {
      found.push_back(gateway.get());
    }
  }
  return found;
}

std::vector<std::string> Plant::programs() const {
  std::vector<std::string> names;
  for (const auto& controller : controllers_) {
    for (const std::uint16_t number : controller->numbers()) {
      names.push_back(Key{controller->name(), number}.to_string());
    }
    for (const auto& ring : controller->queues()) {
      names.push_back(ring->key().to_string());
    }
  }
  return names;
}

std::size_t Plant::channels_of(const std::string& machine) const {
  const auto found = std::ranges::find_if(
      controllers_, [&](const auto& controller) { return controller->name() == machine; });
  return (*found)->size();
}

void Plant::cut_links(const Controller& controller, const std::string& reason) {
  for (const auto& gateway : gateways_) {
    gateway->cut_links(controller.name(), reason);
  }
}

}  // namespace millrace::tests::simulation
