// Samples about calls from processes that were not asked.
#include <algorithm>

#include "tests/simulation/faults/fault_injector.hpp"

namespace millrace::tests::simulation {

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
    count_hits([&](const auto&, const auto& one) { return one.call == status->call; });
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
  count_hits([&](const auto&, const auto& one) { return one.call == status->call; });
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
      count_hits([&](const auto&, const auto& one) { return one.call == status->call; });
      service->speak_again(status->call);
    }
  }
}

}  // namespace millrace::tests::simulation
