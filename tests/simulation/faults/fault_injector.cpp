#include "tests/simulation/faults/fault_injector.hpp"

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
  for (const Fault& one : all()) {
    names.emplace_back(one.name);
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
  count_hits([&](const GatewayProcess& one, const auto&) { return &one == &picked; });
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

}  // namespace millrace::tests::simulation
