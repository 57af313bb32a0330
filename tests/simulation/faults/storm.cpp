#include "tests/simulation/faults/storm.hpp"

#include <utility>

#include "fabric/channel_scope.hpp"

namespace millrace::tests::simulation {

const std::vector<Storm::Fault>& Storm::all() {
  static const std::vector<Fault> all{
      {"cut-link", &Storm::cut_link},
      {"silence-link", &Storm::silence_link},
      {"slow-link", &Storm::slow_link},
      {"refuse-requests", &Storm::refuse_requests},
      {"lose-requests", &Storm::lose_requests},
      {"reset-channel", &Storm::reset_channel},
      {"switch-controller-off", &Storm::switch_controller_off},
      {"kill-gateway", &Storm::kill_gateway},
      {"cut-gateway-power", &Storm::cut_gateway_power},
      {"stop-gateway", &Storm::stop_gateway},
      {"freeze-gateway", &Storm::freeze_gateway},
      {"kill-service", &Storm::kill_service},
      {"drain-service", &Storm::drain_service},
      {"freeze-service", &Storm::freeze_service},
      {"fill-disk", &Storm::fill_disk},
      {"step-clock", &Storm::step_clock},
      {"cut-path", &Storm::cut_path},
      {"cut-off", &Storm::cut_off},
      {"lose-samples", &Storm::lose_samples},
      {"reload-gateway", &Storm::reload_gateway},
      {"part-gateways", &Storm::part_gateways},
      {"stranger-speaks", &Storm::stranger_speaks},
      {"speak-for-another", &Storm::speak_for_another},
      {"speak-again", &Storm::speak_again},
  };
  return all;
}

std::vector<std::string> Storm::names() {
  std::vector<std::string> names;
  for (const Fault& one : all()) {
    names.emplace_back(one.name);
  }
  return names;
}

Storm::Storm(Plant& plant, Random random) : plant_(plant), random_(random) {
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

void Storm::begin(Time duration) {
  end_ = plant_.agenda().now() + duration;
  soon(random_.between(Time{}, pause_), [this] { strike(); });
}

void Storm::soon(Time delay, std::function<void()> act) {
  plant_.agenda().after(delay, {}, [this, act = std::move(act)] {
    if (!over_) {
      act();
    }
  });
}

void Storm::for_a_while(std::function<void()> undo) {
  soon(random_.mostly(10ms, 300ms, longest_fault, 30), std::move(undo));
}

void Storm::strike() {
  if (plant_.agenda().now() >= end_) {
    return;
  }
  const Fault& fault = random_.pick(kinds_);
  if (!plant_.limits().without.contains(std::string(fault.name))) {
    fault_ = fault.name;
    (this->*fault.begin)();
  }
  soon(random_.between(Time{}, 2 * pause_), [this] { strike(); });
}

void Storm::befalls(const Befallen& befallen) {
  for (const auto& gateway : plant_.gateways()) {
    for (const auto& [key, status] : gateway->statuses()) {
      if (befallen(*gateway, status)) {
        ++reach_[{fault_, gateway->checker().step_of(key, status.state)}];
        if (status.state == fabric::ChannelState::running && gateway->checker().at_most_once(key)) {
          ++reach_[{fault_, "once"}];
        }
        if (status.call != fabric::CallId{} && !fabric::queue_of(key.machine).empty()) {
          ++reach_[{fault_, "queue"}];
        }
      }
    }
  }
}

void Storm::befalls_all() {
  befalls([](const auto&, const auto&) { return true; });
}

GatewayProcess& Storm::some_gateway() {
  GatewayProcess& picked = *random_.pick(plant_.gateways());
  befalls([&](const GatewayProcess& one, const auto&) { return &one == &picked; });
  return picked;
}

Controller& Storm::some_controller() {
  Controller& picked = *random_.pick(plant_.controllers());
  befalls([&](const auto&, const fabric::ChannelStatus& status) {
    return fabric::machine_of(status.key.machine) == picked.name();
  });
  return picked;
}

/// One with calls, or one that may get them.
ServiceProcess& Storm::some_service() {
  ServiceProcess& picked = *random_.pick(plant_.services());
  befalls([&](const auto&, const fabric::ChannelStatus& status) {
    return status.instance == picked.instance() || status.instance == fabric::InstanceId{};
  });
  return picked;
}

void Storm::end() {
  over_ = true;
  plant_.history().note("storm", "is over");
  for (auto& cable : plant_.cables()) {
    *cable = Cable{.late_until = cable->late_until};
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
  plant_.fabric().weather.lost = 0;
}

}  // namespace millrace::tests::simulation
