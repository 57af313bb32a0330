#include "tests/simulation/exhaustive/small_plant.hpp"

#include <fmt/format.h>

namespace millrace::tests::simulation {

namespace {

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

/// Virtual time within which every lasting violation shows.
constexpr Time longest = 20s;

/// Time until a killed process restarts.
constexpr Time restart_after = 200ms;

constexpr Party controller_party = 1;
constexpr Party gateway_party = 2;
constexpr Party first_party = 3;
constexpr Party second_party = 4;
constexpr Party gateway_inbox = gateway_party + Process::inboxes;

constexpr std::uint64_t bit(Party party) {
  return std::uint64_t{1} << party;
}

/// Discovery is complete by then.
constexpr Time settled = 800ms;

Random chance(const SmallPlan& plan, std::uint64_t seed) {
  return Random::still(seed, plan.leftovers_dropped);
}

GatewayPlan gateway_plan(const SmallPlan& plan) {
  GatewayPlan gateway;
  gateway::settings::MachineSettings machine;
  machine.name = "m0";
  machine.watch = gateway::SubscriptionMode::poll;
  machine.intervals = {.active = 50ms, .active_for = 0ms, .idle = 50ms, .full = 100ms};
  gateway.file.machines.push_back(machine);
  gateway.watches_itself = false;
  gateway.journal.sync = gateway::journal::Sync::always;
  gateway.journal.period = 1h;
  gateway.bug = plan.bug;
  return gateway;
}

ServicePlan service_plan(const SmallPlan& plan, const std::string& name) {
  ServicePlan service;
  service.name = name;
  service.uuid = uuid;
  service.delivery = plan.delivery;
  service.completion_signal = plan.completion_signal;
  service.behaviour = {.slow = 0, .fails = 0, .refused = 0, .interim = 0, .stuck = 0};
  service.bug = plan.bug;
  return service;
}

}  // namespace

SmallPlant::SmallPlant(Explorer& explorer, const SmallPlan& plan, History::Trace trace)
    : plan_(plan),
      explorer_(explorer),
      agenda_(&explorer),
      history_(agenda_, std::move(trace)),
      fabric_(agenda_, chance(plan, 1)),
      controller_("m0", controller_party, agenda_, history_),
      gateway_(gateway_plan(plan), agenda_, gateway_party, history_, fabric_, chance(plan, 2)),
      first_(service_plan(plan, "first"), agenda_, first_party, history_, fabric_, chance(plan, 3)),
      second_(service_plan(plan, "second"), agenda_, second_party, history_, fabric_,
              chance(plan, 4)) {
  conditions_.delay_least = Time{};
  conditions_.delay_most = Time{};
  conditions_.writes = plan_.writes;
  ProgramBehaviour behaviour;
  behaviour.uuids = {uuid};
  behaviour.calls = plan.calls;
  behaviour.impatient = 0;
  behaviour.waits_for_text = plan.completion_signal == fabric::CompletionSignal::response;
  behaviour.services_know = true;
  controller_.add(plan.rules, behaviour, chance(plan, 5));
  gateway_.plug(controller_, conditions_);
}

/// The parties that the mishap changes at once, in addition to those with a description.
std::uint64_t SmallPlant::struck() const {
  const std::uint64_t described =
      bit(controller_party) | bit(gateway_inbox) | bit(first_party) | bit(second_party);
  const bool link = plan_.mishap == Mishap::link_cut || plan_.mishap == Mishap::link_silent;
  return described | (link ? bit(gateway_party) : 0);
}

void SmallPlant::inject() {
  struck_ = true;
  agenda_.touches(struck());
  switch (plan_.mishap) {
    case Mishap::none:
      break;
    case Mishap::gateway_killed:
    case Mishap::gateway_power_cut:
      gateway_.kill(plan_.mishap == Mishap::gateway_power_cut);
      agenda_.becomes(bit(gateway_party) | bit(gateway_party) << Process::outboxes, 0);
      restart([this] { gateway_.start(); });
      break;
    case Mishap::instance_killed:
      second_.kill();
      agenda_.becomes(bit(second_party) << Process::outboxes, 0);
      restart([this] { second_.start(); });
      break;
    case Mishap::instance_drained:
      second_.drain();
      restart([this] { second_.start(); });
      break;
    case Mishap::link_cut:
      gateway_.cut_links("m0", "connection reset");
      break;
    case Mishap::link_silent:
      conditions_.silent = true;
      restart([this] { conditions_.silent = false; });
      break;
    case Mishap::program_reset:
      controller_.reset(1, Time{});
      break;
  }
}

void SmallPlant::restart(const std::function<void()>& start) {
  agenda_.after(restart_after, {.timer = true, .means = 2}, [this, start] {
    agenda_.touches(struck());
    start();
  });
}

bool SmallPlant::done() const {
  return controller_.done() && struck_ && gateway_.running() && gateway_.open_calls() == 0;
}

/// A running gateway knows too much for a description: its state is all that has happened to it
/// since its start.
void SmallPlant::describe() {
  const auto hash = std::hash<std::string>{};
  explorer_.describe(controller_party, [this, hash] { return hash(controller_.place()); });
  explorer_.describe(gateway_inbox, [this, hash] { return hash(gateway_.hearing()); });
  explorer_.describe(first_party, [this, hash] { return hash(first_.place()); });
  explorer_.describe(second_party, [this, hash] { return hash(second_.place()); });
}

std::string SmallPlant::sight() const {
  std::string words = fmt::format("{} | {} {} | {} {} | {} {}", controller_.place(),
                                  gateway_.running(), gateway_.open_calls(), first_.running(),
                                  first_.idle(), second_.running(), second_.idle());
  for (const auto& [key, status] : gateway_.statuses()) {
    words += fmt::format(" | {} {} {}", static_cast<int>(status.state), status.call.to_string(),
                         status.attempt);
  }
  return words;
}

std::vector<std::string> SmallPlant::run() {
  first_.start();
  second_.start();
  gateway_.start();
  describe();
  // Everything has started when the program begins.
  while (agenda_.now() < settled && agenda_.step()) {
  }
  explorer_.start();
  controller_.start_programs();
  struck_ = plan_.mishap == Mishap::none;
  if (!struck_) {
    // Tried first wherever it is possible.
    agenda_.after(Time{}, {.means = Meaning{0}}, [this] { inject(); });
  }
  while (history_.violations().empty() && !done() && agenda_.now() < longest && agenda_.step()) {
    // An at-most-once call whose instance is lost waits for an operator.
    for (const auto& [key, status] : std::map(gateway_.statuses())) {
      if (status.state == fabric::ChannelState::held) {
        gateway_.answer(key, status.call);
      }
    }
  }
  // The program was reset and has sent a new request; a write for the earlier one may wipe it,
  // which no gateway can prevent.
  const bool wiped = plan_.mishap == Mishap::program_reset && controller_.channel(1).crossed;
  if (history_.violations().empty() && agenda_.now() >= longest && !wiped) {
    history_.violated("I5: the program still waits");
  }
  return history_.violations();
}

Walk walk_through(const SmallPlan& plan, const Bounds& bounds) {
  Explorer explorer(bounds);
  Walk walk;
  do {
    explorer.begin();
    walk.violations = SmallPlant(explorer, plan).run();
  } while (walk.violations.empty() && explorer.next());
  walk.choices = explorer.choices();
  walk.states = explorer.states();
  walk.runs = explorer.runs();
  walk.complete = explorer.complete();
  return walk;
}

std::vector<std::string> retell(const SmallPlan& plan, Bounds bounds, const Walk& walk) {
  std::vector<std::string> lines;
  bounds.draw.reset();
  Explorer explorer(bounds);
  explorer.repeat(walk.choices);
  explorer.begin();
  SmallPlant(explorer, plan, [&](const std::string& line) { lines.push_back(line); }).run();
  return lines;
}

std::set<std::string> sights(const SmallPlan& plan, const Bounds& bounds) {
  std::set<std::string> seen;
  Explorer explorer(bounds);
  do {
    explorer.begin();
    SmallPlant plant(explorer, plan);
    explorer.on_new_choice = [&] { seen.insert(plant.sight()); };
    plant.run();
  } while (explorer.next());
  return seen;
}

}  // namespace millrace::tests::simulation
