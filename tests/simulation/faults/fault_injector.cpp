#include "tests/simulation/faults/fault_injector.hpp"

#include <algorithm>
#include <utility>

#include "fabric/channel_scope.hpp"

namespace millrace::tests::simulation {

const std::vector<FaultInjector::Fault>& FaultInjector::all() {
  static const std::vector<Fault> all{
      {"cut-link", &FaultInjector::cut_link},
      {"silence-link", &FaultInjector::silence_link},
      {"slow-link", &FaultInjector::slow_link},
      {"refuse-requests", &FaultInjector::refuse_requests},
      {"lose-requests", &FaultInjector::lose_requests},
      {"reset-channel", &FaultInjector::reset_channel},
      {"switch-controller-off", &FaultInjector::switch_controller_off},
      {"kill-gateway", &FaultInjector::kill_gateway},
      {"cut-gateway-power", &FaultInjector::cut_gateway_power},
      {"stop-gateway", &FaultInjector::stop_gateway},
      {"freeze-gateway", &FaultInjector::freeze_gateway},
      {"kill-service", &FaultInjector::kill_service},
      {"drain-service", &FaultInjector::drain_service},
      {"freeze-service", &FaultInjector::freeze_service},
      {"fill-disk", &FaultInjector::fill_disk},
      {"step-clock", &FaultInjector::step_clock},
      {"cut-path", &FaultInjector::cut_path},
      {"cut-off", &FaultInjector::cut_off},
      {"lose-samples", &FaultInjector::lose_samples},
      {"reload-gateway", &FaultInjector::reload_gateway},
      {"part-gateways", &FaultInjector::part_gateways},
      {"stranger-speaks", &FaultInjector::stranger_speaks},
      {"speak-for-another", &FaultInjector::speak_for_another},
      {"speak-again", &FaultInjector::speak_again},
  };
  return all;
}

std::vector<std::string> FaultInjector::names() {
  std::vector<std::string> names;
  for (const Fault& fault : all()) {
    names.emplace_back(fault.name);
  }
  return names;
}

FaultInjector::FaultInjector(Plant& plant, Random random) : plant_(plant), random_(random) {
  const auto share = static_cast<unsigned>(10 + random_.below(60));
  for (const Fault& fault : all()) {
    if (random_.chance(share)) {
      kinds_.push_back(fault);
    }
  }
  pause_ = random_.between(20ms, 400ms);
  if (random_.chance(20)) {
    // Only one or two kinds, but often.
    kinds_ = {random_.pick(all()), random_.pick(all())};
    pause_ = random_.between(2ms, 60ms);
  }
  if (kinds_.empty()) {
    kinds_.push_back(random_.pick(all()));
  }
}

void FaultInjector::begin(Time duration) {
  end_ = plant_.agenda().now() + duration;
  soon(random_.between(Time{}, pause_), [this] { inject(); });
}

void FaultInjector::soon(Time delay, std::function<void()> act) {
  plant_.agenda().after(delay, {}, [this, act = std::move(act)] {
    if (!over_) {
      act();
    }
  });
}

void FaultInjector::for_a_while(std::function<void()> undo) {
  soon(random_.mostly(10ms, 300ms, longest_fault, 30), std::move(undo));
}

void FaultInjector::inject() {
  if (plant_.agenda().now() >= end_) {
    return;
  }
  const Fault& fault = random_.pick(kinds_);
  if (!plant_.limits().without.contains(std::string(fault.name))) {
    fault_ = fault.name;
    (this->*fault.begin)();
  }
  soon(random_.between(Time{}, 2 * pause_), [this] { inject(); });
}

void FaultInjector::count_hits(const ChannelFilter& filter) {
  for (const auto& gateway : plant_.gateways()) {
    for (const auto& [key, status] : gateway->statuses()) {
      if (filter(*gateway, status)) {
        ++coverage_[{fault_, gateway->checker().step_of(key, status.state)}];
        if (status.state == fabric::ChannelState::running && gateway->checker().at_most_once(key)) {
          ++coverage_[{fault_, "once"}];
        }
        if (status.call != fabric::CallId{} && !fabric::queue_of(key.machine).empty()) {
          ++coverage_[{fault_, "queue"}];
        }
      }
    }
  }
}

void FaultInjector::count_all_hits() {
  count_hits([](const auto&, const auto&) { return true; });
}

GatewayProcess& FaultInjector::some_gateway() {
  GatewayProcess& picked = *random_.pick(plant_.gateways());
  count_hits([&](const GatewayProcess& gateway_process, const auto&) {
    return &gateway_process == &picked;
  });
  return picked;
}

Controller& FaultInjector::some_controller() {
  Controller& picked = *random_.pick(plant_.controllers());
  count_hits([&](const auto&, const fabric::ChannelStatus& status) {
    return fabric::machine_of(status.key.machine) == picked.name();
  });
  return picked;
}

/// One with calls, or one that may get them.
ServiceProcess& FaultInjector::some_service() {
  ServiceProcess& picked = *random_.pick(plant_.services());
  count_hits([&](const auto&, const fabric::ChannelStatus& status) {
    return status.instance == picked.instance() || status.instance == fabric::InstanceId{};
  });
  return picked;
}

void FaultInjector::end() {
  over_ = true;
  plant_.history().note("faults", "are over");
  for (auto& conditions : plant_.link_conditions()) {
    *conditions = LinkConditions{.late_until = conditions->late_until};
  }
  for (auto& gateway : plant_.gateways()) {
    gateway->disk().full = false;
    gateway->thaw();
    gateway->reload(plant_.first_file(*gateway));
  }
  for (auto& service : plant_.services()) {
    service->thaw();
  }
  for (auto& controller : plant_.controllers()) {
    controller->switch_on();
    controller->calm_down();
  }
  plant_.fabric().open_all_paths();
  plant_.fabric().conditions.lost = 0;
}

// Faults of the network between gateways and services.

void FaultInjector::cut_path() {
  // In one direction, or in both.
  const auto ends = plant_.fabric().ends();
  if (ends.size() < 2) {
    return;
  }
  const EndNumber from = ends[random_.below(ends.size())];
  const EndNumber to = ends[random_.below(ends.size())];
  const bool both = random_.chance(50);
  const auto set = [this, from, to, both](bool open) {
    plant_.fabric().set_path(from, to, open);
    if (both) {
      plant_.fabric().set_path(to, from, open);
    }
  };
  count_all_hits();
  plant_.history().note("network", "a path is cut");
  set(false);
  for_a_while([this, set] {
    plant_.history().note("network", "a path is open again");
    set(true);
  });
}

void FaultInjector::cut_off() {
  // One end is cut off from all others.
  const auto ends = plant_.fabric().ends();
  if (ends.empty()) {
    return;
  }
  const EndNumber end_number = ends[random_.below(ends.size())];
  const auto set = [this, end_number, ends](bool open) {
    for (const EndNumber other : ends) {
      plant_.fabric().set_path(end_number, other, open);
      plant_.fabric().set_path(other, end_number, open);
    }
  };
  count_all_hits();
  plant_.history().note("network", "an end is cut off");
  set(false);
  for_a_while([this, set] {
    plant_.history().note("network", "an end is back");
    set(true);
  });
}

void FaultInjector::part_gateways() {
  // Each continues with its controllers and services and regards the other as gone.
  const auto& gateways = plant_.gateways();
  if (gateways.size() < 2) {
    return;
  }
  const auto isolated = random_.pick(gateways)->end();
  const auto other = random_.pick(gateways)->end();
  if (!isolated || !other || isolated == other) {
    return;
  }
  count_hits([&](const GatewayProcess& gateway, const auto&) {
    return gateway.end() == isolated || gateway.end() == other;
  });
  const auto set = [this, from = *isolated, to = *other](bool open) {
    plant_.fabric().set_path(from, to, open);
    plant_.fabric().set_path(to, from, open);
  };
  plant_.history().note("network", "two gateways do not hear each other");
  set(false);
  for_a_while([this, set] {
    plant_.history().note("network", "two gateways hear each other again");
    set(true);
  });
}

void FaultInjector::lose_samples() {
  count_all_hits();
  FabricConditions& conditions = plant_.fabric().conditions;
  conditions.lost = static_cast<unsigned>(1 + random_.below(60));
  conditions.delay_most = random_.mostly(1ms, 20ms, 300ms, 30);
  for_a_while([&conditions] {
    conditions.lost = 0;
    conditions.delay_most = FabricConditions{}.delay_most;
  });
}

// Faults of controllers and of the links to them.

void FaultInjector::cut_link() {
  Controller& controller = some_controller();
  plant_.cut_links(controller, "connection reset");
}

void FaultInjector::silence_link() {
  Controller& controller = some_controller();
  LinkConditions& conditions = plant_.conditions_of(controller);
  conditions.silent = true;
  // A separate random source, so that the rest of a seed keeps its meaning.
  conditions.router_refuses = Random(~random_.state()).chance(25);
  plant_.history().note(controller.name(), conditions.router_refuses
                                               ? "a router answers in its place"
                                               : "nothing comes through");
  for_a_while([this, &conditions, &controller] {
    plant_.history().note(controller.name(), "all comes through again");
    conditions.silent = false;
  });
}

void FaultInjector::slow_link() {
  Controller& controller = some_controller();
  LinkConditions& conditions = plant_.conditions_of(controller);
  conditions.delay_most = random_.mostly(5ms, 200ms, 2500ms, 30);
  conditions.delay_least = random_.between(Time{}, conditions.delay_most);
  conditions.late_until = std::max(
      conditions.late_until, plant_.agenda().now() + longest_fault + 2 * conditions.delay_most);
  plant_.history().note(controller.name(), "is slow");
  for_a_while([&conditions] {
    conditions.delay_least = LinkConditions{}.delay_least;
    conditions.delay_most = LinkConditions{}.delay_most;
  });
}

void FaultInjector::refuse_requests() {
  LinkConditions& conditions = plant_.conditions_of(some_controller());
  conditions.refused = static_cast<unsigned>(1 + random_.below(50));
  for_a_while([&conditions] { conditions.refused = 0; });
}

void FaultInjector::lose_requests() {
  LinkConditions& conditions = plant_.conditions_of(some_controller());
  conditions.lost = static_cast<unsigned>(1 + random_.below(30));
  for_a_while([&conditions] { conditions.lost = 0; });
}

void FaultInjector::reset_channel() {
  Controller& controller = *random_.pick(plant_.controllers());
  const Time pause = random_.mostly(Time{}, 20ms, 500ms, 50);
  const auto channel = static_cast<std::uint16_t>(1 + random_.below(controller.size()));
  count_hits([&](const auto&, const fabric::ChannelStatus& status) {
    return status.key == Key{controller.name(), channel};
  });
  controller.reset(channel, pause);
}

void FaultInjector::switch_controller_off() {
  Controller& controller = some_controller();
  if (!controller.powered()) {
    return;
  }
  controller.switch_off();
  if (random_.chance(50)) {
    plant_.cut_links(controller, "connection reset");
  }
  for_a_while([this, &controller] {
    controller.switch_on();
    // Its TCP stack answers the old connection's next segment with a reset.
    plant_.cut_links(controller, "connection reset");
  });
}

// Faults of gateways and services.

void FaultInjector::kill_gateway() {
  some_gateway().kill(false);
}

void FaultInjector::cut_gateway_power() {
  some_gateway().kill(true);
}

void FaultInjector::stop_gateway() {
  some_gateway().stop();
}

void FaultInjector::freeze_gateway() {
  GatewayProcess& gateway = some_gateway();
  gateway.freeze();
  for_a_while([&gateway] { gateway.thaw(); });
}

void FaultInjector::kill_service() {
  some_service().kill();
}

void FaultInjector::drain_service() {
  some_service().drain();
}

void FaultInjector::freeze_service() {
  ServiceProcess& service = some_service();
  service.freeze();
  for_a_while([&service] { service.thaw(); });
}

void FaultInjector::fill_disk() {
  GatewayProcess& gateway = some_gateway();
  plant_.history().note("disk", "is full");
  gateway.disk().full = true;
  for_a_while([this, &gateway] {
    plant_.history().note("disk", "has room again");
    gateway.disk().full = false;
  });
}

void FaultInjector::reload_gateway() {
  GatewayProcess& gateway = some_gateway();
  GatewayFile file = plant_.first_file(gateway);
  std::erase_if(file.machines, [this](const auto&) { return random_.chance(20); });
  for (auto& machine : file.machines) {
    if (random_.chance(40)) {
      machine.channels = {1};
      if (random_.chance(30) && plant_.channels_of(machine.name) > 1) {
        machine.channels.push_back(2);
      }
    }
    if (random_.chance(30)) {
      machine.intervals.idle = std::chrono::milliseconds(10 + random_.below(80));
    }
    // A separate random source, so that the rest of a seed keeps its meaning.
    if (Random chance(~random_.state()); chance.chance(30)) {
      std::erase_if(machine.queues, [&](auto&) { return chance.chance(60); });
    } else if (chance.chance(20)) {
      for (auto& queue : machine.queues) {
        queue.backlog = 1 + chance.below(20);
        queue.uuid = chance.pick(plant_.uuids());
      }
    }
    if (random_.chance(20)) {
      // A different address of the same controller.
      ++machine.controller.tcp_port;
    }
  }
  if (random_.chance(50)) {
    file.policies = plant_.draw_policies(random_);
  }
  gateway.reload(file);
  for_a_while([this, &gateway] { gateway.reload(plant_.first_file(gateway)); });
}

void FaultInjector::step_clock() {
  const Time by = random_.between(-7200s, 7200s);
  if (random_.chance(60)) {
    some_gateway().step_clock(by);
  } else {
    some_service().step_clock(by);
  }
}

// Samples about calls from processes that were not asked.

std::optional<fabric::ChannelStatus> FaultInjector::some_call() {
  std::vector<fabric::ChannelStatus> found;
  for (const auto& gateway : plant_.gateways()) {
    for (const auto& [key, status] : gateway->statuses()) {
      if (status.call != fabric::CallId{}) {
        found.push_back(status);
      }
    }
  }
  return found.empty() ? std::nullopt : std::optional(random_.pick(found));
}

void FaultInjector::stranger_speaks() {
  const auto status = some_call();
  if (status && plant_.stranger() != nullptr) {
    count_hits([&](const auto&, const auto& hit) { return hit.call == status->call; });
    plant_.stranger()->speak_of(*status);
  }
}

void FaultInjector::speak_for_another() {
  // The writer belongs to the instance nevertheless.
  const auto status = some_call();
  const ServiceProcess& service = *random_.pick(plant_.services());
  if (!status || !service.running() || service.frozen() || service.instance() == status->instance) {
    return;
  }
  count_hits([&](const auto&, const auto& hit) { return hit.call == status->call; });
  const fabric::Reply reply = words_of_a_stranger(*status, status->instance, random_);
  plant_.history().note(service.name(),
                        "speaks for another: " + to_string(Replied{service.instance(), reply}));
  plant_.fabric().publish(*service.end(), reply);
}

void FaultInjector::speak_again() {
  const auto status = some_call();
  if (!status || status->state != fabric::ChannelState::answering) {
    return;
  }
  for (const auto& service : plant_.services()) {
    if (service->running() && service->instance() == status->instance) {
      count_hits([&](const auto&, const auto& hit) { return hit.call == status->call; });
      service->speak_again(status->call);
    }
  }
}

}  // namespace millrace::tests::simulation
