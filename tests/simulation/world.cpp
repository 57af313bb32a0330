#include "tests/simulation/world.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tests/simulation/crash_report.hpp"

namespace millrace::tests::simulation {

namespace {

/// Once faults have stopped, everything open is answered within this time.
constexpr Time recovery = 60s;
/// Everything late has arrived by then.
constexpr Time aftermath = 4s;
/// Two gateways that hear each other have agreed within this time which one serves a channel.
constexpr Time settlement = 500ms;

}  // namespace

std::string replay(std::uint64_t seed, Bug bug, const Limits& limits) {
  std::string command = fmt::format("millrace-simulation --seed {} --trace", seed);
  if (!limits.quiet.empty()) {
    command += fmt::format(" --quiet {}", fmt::join(limits.quiet, ","));
  }
  if (!limits.without.empty()) {
    command += fmt::format(" --without {}", fmt::join(limits.without, ","));
  }
  if (limits.faults_for) {
    command += fmt::format(" --faults-for {}", limits.faults_for->count());
  }
  for (const BugName& name : bug_names) {
    if (name.bug == bug) {
      command += fmt::format(" --bug {}", name.name);
    }
  }
  return command;
}

World::World(std::uint64_t seed, Options options)
    : seed_(seed),
      bug_(options.bug),
      limits_(options.limits),
      random_(Random(~seed).next()),
      history_(agenda_, std::move(options.trace)),
      plant_(agenda_, history_, random_.fork(), options.bug, options.limits) {
  faults_ = std::make_unique<FaultInjector>(plant_, random_.fork());
  // A separate random source, so that the rest of a seed keeps its meaning.
  Random random(~seed ^ 0x7a1e5ab1e0000001U);
  if (random.chance(40)) {
    value_user_.emplace(plant_, random.fork());
  }
}

World::~World() = default;

/// Restarts ended processes, as a supervisor does.
void World::supervise() {
  for (auto& gateway : plant_.gateways()) {
    if (!gateway->running()) {
      agenda_.after(random_.mostly(100ms, 300ms, 2000ms, 20), {}, [&gateway] { gateway->start(); });
    }
  }
  for (auto& service : plant_.services()) {
    if (calm_ && service->stuck()) {
      service->kill();
    }
    if (!service->running()) {
      agenda_.after(random_.mostly(10ms, 300ms, 2000ms, 20), {}, [&service] { service->start(); });
    }
  }
  agenda_.after(200ms, {}, [this] { supervise(); });
}

/// Finds calls that wait for a decision, and decides.
void World::operate() {
  for (auto& gateway : plant_.gateways()) {
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

/// Of two gateways that hear each other only one serves a channel.
void World::watch_the_serving() {
  const auto& gateway_topics = plant_.fabric().gateway_topics();
  const auto both = [&](const Key& key) {
    const auto& gateways = plant_.gateways();
    for (std::size_t a = 0; a < gateways.size(); ++a) {
      for (std::size_t b = a + 1; b < gateways.size(); ++b) {
        if (gateways[a]->serves(key) && gateways[b]->serves(key) &&
            gateway_topics.hears(*gateways[a]->end(), *gateways[b]->end()) &&
            gateway_topics.hears(*gateways[b]->end(), *gateways[a]->end())) {
          return true;
        }
      }
    }
    return false;
  };
  for (const auto& controller : plant_.controllers()) {
    for (const std::uint16_t number : controller->numbers()) {
      const Key key{controller->name(), number};
      if (!both(key)) {
        both_since_.erase(key);
      } else if (agenda_.now() - both_since_.try_emplace(key, agenda_.now()).first->second >
                 settlement) {
        history_.violated(
            fmt::format("two gateways serve {}, although they hear each other", key.to_string()));
      }
    }
  }
  agenda_.after(50ms, {}, [this] { watch_the_serving(); });
}

/// An operator at the machine resets a program that waits in vain, which four causes excuse: a
/// journal lost its end; an interim answer met the next request; a program did not wait for the end
/// of an answer; the controller lost a write of a gateway that left before it noticed.
void World::rescue() {
  for (auto& controller : plant_.controllers()) {
    const auto gateways = plant_.gateways_of(*controller);
    const bool lost_memory = std::ranges::any_of(gateways, &GatewayProcess::lost_memory);
    for (const std::uint16_t number : controller->numbers()) {
      const bool idle = std::ranges::any_of(gateways, [&](const GatewayProcess* gateway) {
        const auto status = gateway->statuses().find({controller->name(), number});
        return status != gateway->statuses().end() &&
               (status->second.state == fabric::ChannelState::idle ||
                status->second.state == fabric::ChannelState::answering);
      });
      const bool excused = lost_memory || controller->channel(number).crossed ||
                           controller->channel(number).orphaned() ||
                           controller->channel(number).writers.size() > 1 ||
                           controller->program(number).may_be_stuck();
      if (excused && idle && !controller->program(number).done()) {
        controller->reset(number, 100ms);
      }
    }
  }
}

bool World::done() {
  return std::ranges::all_of(plant_.controllers(),
                             [](const auto& controller) { return controller->done(); }) &&
         std::ranges::all_of(plant_.gateways(), [](const auto& gateway) {
           return gateway->running() && gateway->open_calls() == 0 &&
                  gateway->waiting_messages() == 0;
         });
}

void World::judge_the_end() {
  for (const auto& controller : plant_.controllers()) {
    for (const std::uint16_t number : controller->numbers()) {
      if (controller->program(number).done()) {
        continue;
      }
      const Key key{controller->name(), number};
      std::string words;
      for (const GatewayProcess* gateway : plant_.gateways_of(*controller)) {
        const auto status = gateway->statuses().find(key);
        words +=
            fmt::format("; gateway {} says: {}", gateway->number(),
                        status == gateway->statuses().end() ? "nothing" : status->second.reason);
      }
      history_.violated(
          fmt::format("I5: {} still waits {} s after the last fault{}", key.to_string(),
                      std::chrono::duration_cast<std::chrono::seconds>(recovery).count(), words));
    }
  }
  for (const auto& controller : plant_.controllers()) {
    for (const auto& ring : controller->queues()) {
      if (!ring->done()) {
        const auto control = ring->control();
        history_.violated(fmt::format("I5: messages stand in {}: LastFilled {}, LastGet {}",
                                      ring->key().to_string(), control.last_filled,
                                      control.last_get));
      }
    }
  }
  for (const auto& gateway : plant_.gateways()) {
    if (gateway->open_calls() > 0) {
      history_.violated(fmt::format("I5: gateway {} still has {} open calls", gateway->number(),
                                    gateway->open_calls()));
    }
    if (gateway->waiting_messages() > 0) {
      history_.violated(fmt::format("I5: gateway {} still has {} messages", gateway->number(),
                                    gateway->waiting_messages()));
    }
  }
}

Outcome World::run() {
  const CrashReport report(fmt::format("seed {}", seed_), replay(seed_, bug_, limits_));
  for (auto& service : plant_.services()) {
    agenda_.after(random_.between(Time{}, 300ms), {}, [&service] { service->start(); });
  }
  for (auto& gateway : plant_.gateways()) {
    agenda_.after(random_.between(Time{}, 300ms), {}, [&gateway] { gateway->start(); });
  }
  if (plant_.stranger() != nullptr) {
    plant_.stranger()->start();
  }
  for (auto& controller : plant_.controllers()) {
    controller->start_programs();
  }
  agenda_.after(400ms, {}, [this] { supervise(); });
  operate();
  watch_the_serving();
  if (value_user_) {
    value_user_->start();
  }

  const Time drawn = random_.between(1s, 8s);
  const Time faults_for = limits_.faults_for.value_or(drawn);
  agenda_.after(100ms, {}, [this, faults_for] { faults_->begin(faults_for); });
  const auto go_on = [&](Time until) {
    while (history_.violations().empty() && agenda_.now() < until && agenda_.step()) {
    }
  };
  go_on(faults_for + 100ms);
  if (history_.violations().empty()) {
    faults_->end();
    calm_ = true;
    for (auto& service : plant_.services()) {
      service->calm_down();
    }
    if (value_user_) {
      value_user_->calm_down();
    }
    const Time latest = agenda_.now() + recovery;
    agenda_.after(recovery / 2, {}, [this] { rescue(); });
    while (history_.violations().empty() && !done() && agenda_.now() < latest && agenda_.step()) {
    }
    if (history_.violations().empty()) {
      judge_the_end();
    }
    go_on(agenda_.now() + aftermath);
    if (history_.violations().empty()) {
      history_.judge_the_end();
    }
  }
  Outcome outcome{history_.violations(), agenda_.now(), 0, faults_for, faults_->coverage()};
  for (const auto& controller : plant_.controllers()) {
    for (const std::uint16_t number : controller->numbers()) {
      outcome.answered += controller->program(number).answered();
    }
  }
  return outcome;
}

}  // namespace millrace::tests::simulation
