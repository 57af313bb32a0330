#include "fabric/plant/event.hpp"

#include <algorithm>
#include <array>

#include "base/messages/catalogue.hpp"
#include "base/text/cp1252.hpp"

namespace millrace::fabric::plant {

namespace {

namespace messages = base::messages;
using Happened = PlantEvent::Kind;
using Found = std::optional<PlantEvent>;

Found event_of(const observer::InstanceNews& news, Time at, const Plant& before) {
  using enum observer::Change;
  const auto present = before.instances().find(news.identity.id);
  const auto absent = before.gone().find(news.identity.id);
  const bool was_silent = absent != before.gone().end() && absent->second.silent;
  const bool was_present = present != before.instances().end();
  const bool is_change = observer::is_absent(news.change)
                             ? was_present || (was_silent && news.change == gone)
                             : was_silent;
  if (!is_change) {
    return std::nullopt;
  }
  // The news about an instance that is gone or silent has nothing but its id.
  const InstanceIdentity& of =
      was_present ? present->second.identity : absent->second.last.identity;
  const bool is_alone = std::ranges::none_of(before.instances(), [&](const auto& each) {
    return each.second.identity.uuid == of.uuid && each.first != of.id;
  });
  return PlantEvent{.at = at,
                    .kind = news.change == gone     ? Happened::instance_ended
                            : news.change == silent ? Happened::instance_silent
                                                    : Happened::instance_responds,
                    .uuid = of.uuid,
                    .name = of.name,
                    .host = of.host,
                    .pid = of.pid,
                    .who = of.id,
                    .last = observer::is_absent(news.change) && is_alone};
}

/// The instance publishes its own start time, so this holds for those that are older than the
/// observer.
Found event_of(const InstanceStatus& status, Time /*at*/, const Plant& before) {
  const auto known = before.instances().find(status.instance);
  if (known == before.instances().end() || known->second.status || status.started == Time{}) {
    return std::nullopt;
  }
  const InstanceIdentity& identity = known->second.identity;
  return PlantEvent{.at = status.started,
                    .kind = Happened::instance_started,
                    .uuid = identity.uuid,
                    .name = identity.name,
                    .host = identity.host,
                    .pid = identity.pid,
                    .who = identity.id};
}

PlantEvent gateway_event(Happened kind, const MachineStatus& of, Time at) {
  return {.at = at,
          .kind = kind,
          .machines = {of.machine},
          .host = of.host,
          .pid = of.pid,
          .who = of.gateway};
}

bool is_silent(const MachineStatus& status) {
  return status.gone && messages::gateway_not_responding.is(status.reason);
}

Found event_of(const MachineStatus& status, Time at, const Plant& before) {
  const auto known = before.machines().find({status.machine, status.gateway});
  const MachineStatus* const last = known == before.machines().end() ? nullptr : &known->second;
  const bool was_present = last != nullptr && !last->gone;
  const bool was_silent = last != nullptr && is_silent(*last);
  if (status.gone) {
    if (!was_present && !(was_silent && !is_silent(status))) {
      return std::nullopt;
    }
    const MachineStatus* const present = before.last_sample(status);
    return gateway_event(messages::machine_removed.is(status.reason) ? Happened::machine_removed
                         : is_silent(status)                         ? Happened::gateway_silent
                                                                     : Happened::gateway_gone,
                         present == nullptr ? status : *present, at);
  }
  if (was_silent) {
    return gateway_event(Happened::gateway_responds, status, at);
  }
  if (!was_present) {
    // The first sample of a machine says nothing: the observer may be younger than its gateway.
    return before.knows_machine(status.machine)
               ? Found(gateway_event(Happened::gateway_started, status,
                                     status.claimed == Time{} ? status.since : status.claimed))
               : std::nullopt;
  }
  // A gateway that has just started is about to connect: only a lost connection is news.
  const bool is_change = status.connected ? before.lost_link(status) : before.loses_link(status);
  if (!is_change || before.is_connected_through_another(status)) {
    return std::nullopt;
  }
  return PlantEvent{.at = status.since,
                    .kind = status.connected ? Happened::link_up : Happened::link_down,
                    .machines = {status.machine},
                    .who = status.gateway,
                    .text = status.connected ? Message() : status.reason};
}

Found event_of(const ChannelStatus& status, Time /*at*/, const Plant& before) {
  const auto known = before.channels().find(status.key);
  const bool was_known = known != before.channels().end();
  const auto state_before = was_known ? known->second.state : ChannelState::idle;
  PlantEvent event{.at = status.since,
                   .machines = {status.key.machine},
                   .channel = status.key.channel,
                   .call = status.call,
                   .uuid = status.uuid};
  if (status.state == ChannelState::held && state_before != ChannelState::held) {
    event.kind = Happened::call_held;
    event.text = status.reason;
    return event;
  }
  if (messages::dispatched_again.is(status.reason) && was_known &&
      known->second.reason != status.reason) {
    event.kind = Happened::call_retried;
    event.text = status.reason.arguments.front();
    return event;
  }
  return std::nullopt;
}

Found event_of(const Event& event, Time /*at*/, const Plant& /*before*/) {
  if (!messages::answered_by.is(event.detail) || event.replayed) {
    return std::nullopt;
  }
  return PlantEvent{.at = event.at,
                    .kind = Happened::call_answered,
                    .machines = {event.key.machine},
                    .channel = event.key.channel,
                    .call = event.call,
                    .uuid = event.uuid,
                    .text = event.detail.arguments.front()};
}

Found event_of(const ProgramEvent& event, Time /*at*/, const Plant& /*before*/) {
  // A new gateway repeats an error that still stands.
  if (event.kind != ProgramEventKind::aborted || event.replayed) {
    return std::nullopt;
  }
  return PlantEvent{.at = event.at,
                    .kind = Happened::program_aborted,
                    .machines = {event.key.machine},
                    .channel = event.key.channel,
                    .name = base::text::to_utf8(event.program),
                    .error = event.error};
}

Found event_of(const observer::AlarmNews& news, Time at, const Plant& before) {
  const auto known = before.alarms().find(news.alarm.key);
  const Alarm* const last = known == before.alarms().end() ? nullptr : &known->second;
  const auto event = [](Happened kind, Time when, const Alarm& of) {
    return PlantEvent{.at = when,
                      .kind = kind,
                      .name = of.program,
                      .host = of.host,
                      .pid = of.pid,
                      .who = of.key.responder};
  };
  if (news.over && news.lost && last != nullptr && says_that_it_runs(news.alarm.key)) {
    return event(Happened::process_gone, at, *last);
  }
  const bool was_problem = last != nullptr && last->level == AlarmLevel::problem;
  const bool is_problem = !news.over && news.alarm.level == AlarmLevel::problem;
  // The alarm about a lost service is shown with the instance that ended.
  if (was_problem == is_problem || news.alarm.key.kind == "service") {
    return std::nullopt;
  }
  PlantEvent found = is_problem ? event(Happened::problem, news.alarm.since, news.alarm)
                                : event(Happened::problem_over, at, *last);
  found.text = is_problem ? news.alarm.text : last->text;
  return found;
}

template <typename Other>
Found event_of(const Other& /*no event*/, Time /*at*/, const Plant& /*before*/) {
  return std::nullopt;
}

}  // namespace

std::string_view name_of(PlantEvent::Kind kind) {
  constexpr std::array names{
#define MILLRACE_EVENT_KIND(kind, name) std::string_view(name),
#include "fabric/plant/event_kinds.def"
#undef MILLRACE_EVENT_KIND
  };
  return names.at(static_cast<std::size_t>(kind));
}

std::optional<PlantEvent> event_of(const observer::Entry& entry, const Plant& before) {
  return std::visit([&](const auto& sample) { return event_of(sample, entry.at, before); },
                    entry.sample);
}

}  // namespace millrace::fabric::plant
