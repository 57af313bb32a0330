#include "fabric/plant/channel_view.hpp"

#include <algorithm>

#include "base/messages/catalogue.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/words.hpp"

namespace millrace::fabric::plant {

namespace {

/// When the machine lost its gateway or its link; nothing if it has both.
std::optional<Time> without_link_since(const Plant& plant, std::string_view machine) {
  if (const MachineStatus* const status = gateway_without_link(plant, machine)) {
    return status->since;
  }
  const std::optional<LostMachine> lost = plant.lost(machine);
  return lost ? std::optional(lost->since) : std::nullopt;
}

/// Its call runs far longer than the calls of its service do.
bool runs_long(const Plant& plant, const ChannelStatus& status, Time now,
               const Patience& patience) {
  std::chrono::nanoseconds mean{};
  for (const auto& [id, instance] : plant.instances()) {
    if (instance.status && instance.identity.uuid == canonical_uuid(status.uuid)) {
      mean = std::max(mean, instance.status->mean);
    }
  }
  return now - status.since >= std::max(patience.running_look, patience.running_means * mean);
}

}  // namespace

Link link_of(const Plant& plant, std::string_view machine) {
  bool is_present = false;
  for (auto link = plant.machines().lower_bound({std::string(machine), {}});
       link != plant.machines().end() && link->first.first == machine; ++link) {
    if (link->second.connected) {
      return Link::up;
    }
    is_present = is_present || !link->second.gone;
  }
  return is_present ? Link::down : Link::gone;
}

const MachineStatus* gateway_without_link(const Plant& plant, std::string_view machine) {
  const MachineStatus* found = nullptr;
  for (auto link = plant.machines().lower_bound({std::string(machine), {}});
       link != plant.machines().end() && link->first.first == machine; ++link) {
    const MachineStatus& status = link->second;
    if (!status.gone && !status.connected && (found == nullptr || status.since > found->since)) {
      found = &status;
    }
  }
  return found;
}

bool is_silent_for_a_moment(const LostMachine& lost, Time now, const Patience& patience) {
  return base::messages::gateway_not_responding.is(lost.reason) &&
         now - lost.since < patience.silent_gateway;
}

std::optional<Kind> obstacle_of(const Plant& plant, const ChannelStatus& status, Time now,
                                const Patience& patience) {
  const std::string_view machine = machine_of(status.key.machine);
  const Link link = link_of(plant, machine);
  if (link == Link::gone || status.gone) {
    const std::optional<LostMachine> lost = plant.lost(machine);
    // For a moment its last status holds: a call that is held stays so while its gateway is late.
    if (!lost || !is_silent_for_a_moment(*lost, now, patience)) {
      return Kind::gateway_gone;
    }
  }
  if (link == Link::down) {
    return Kind::link_down;
  }
  switch (status.state) {
    case ChannelState::link_down:
      return Kind::link_down;
    case ChannelState::idle:
    case ChannelState::answering:
      return std::nullopt;
    case ChannelState::running:
      return base::messages::deadline.is(status.reason) || runs_long(plant, status, now, patience)
                 ? std::optional(Kind::overdue)
                 : std::nullopt;
    case ChannelState::unserved:
      // Without a journal the gateway accepts no calls, and has not looked for a service.
      return plant.journal_alarm(machine) != nullptr ? Kind::journal : Kind::unserved;
    case ChannelState::waiting:
      // The call waits for an instance, and there is none.
      return plant.instances_for(status.uuid, status.key) == 0 ? Kind::unserved : Kind::waiting;
    case ChannelState::held:
      return Kind::held;
  }
  return Kind::unknown;
}

bool was_served(const ChannelStatus& status) {
  return !status.reason.code.starts_with(base::messages::unknown_uuid.code);
}

Level level_of(const std::optional<Kind>& obstacle, const ChannelStatus& status, Time now,
               const Patience& patience) {
  if (!obstacle) {
    return Level::fine;
  }
  const auto age = now - status.since;
  switch (*obstacle) {
    case Kind::unserved:
      return age < (was_served(status) ? patience.lost_service : patience.unknown_uuid)
                 ? Level::fine
                 : Level::act;
    case Kind::waiting:
      return age < patience.waiting_look  ? Level::fine
             : age < patience.waiting_act ? Level::look
                                          : Level::act;
    case Kind::overdue:
    case Kind::unknown:
      return Level::look;
    default:
      return Level::act;
  }
}

const Program* shown_program(const Plant& plant, const ChannelStatus& status,
                             const std::optional<Kind>& obstacle, Level level) {
  const Program* const program = plant.program_of(status.key);
  const bool is_call_the_cause = level == Level::act && obstacle != Kind::waiting;
  if (program == nullptr || program->state == Program::State::running || is_call_the_cause) {
    return nullptr;
  }
  return program->state == Program::State::aborted || status.state == ChannelState::idle ? program
                                                                                         : nullptr;
}

ChannelView view_of(const Plant& plant, const ChannelStatus& status, Time now,
                    const Patience& patience) {
  const std::optional<Kind> obstacle = obstacle_of(plant, status, now, patience);
  ChannelView view{.call = obstacle ? name_of(*obstacle) : name_of(status.state),
                   .call_level = level_of(obstacle, status, now, patience),
                   .since = status.since,
                   .why = status.reason};
  if (status.gone && obstacle == Kind::gateway_gone) {
    view.why = base::messages::gateway_gone();
  }
  if (obstacle == Kind::gateway_gone || obstacle == Kind::link_down) {
    view.since = without_link_since(plant, machine_of(status.key.machine)).value_or(status.since);
  }
  view.state = view.call;
  view.level = view.call_level;
  if (const Program* const program = shown_program(plant, status, obstacle, view.level)) {
    const bool is_aborted = program->state == Program::State::aborted;
    view.state = name_of(is_aborted ? Kind::program_aborted : Kind::program_on_hold);
    view.level = is_aborted ? Level::act : Level::look;
    view.since = program->event.at;
  }
  return view;
}

}  // namespace millrace::fabric::plant
