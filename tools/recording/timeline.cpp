#include "tools/recording/timeline.hpp"

#include <algorithm>

namespace millrace::tools::recording {

namespace {

/// When a step must have been by the gateway's clock: a service's step is placed between those of
/// its attempt.
fabric::Time place_of(const Call& call, const Step& service) {
  if (!service.by_service) {
    return service.at;
  }
  fabric::Time from = fabric::Time::min();
  fabric::Time to = fabric::Time::max();
  for (const Step& step : call.steps) {
    // An operator's answer to the attempt sets no limit: the service may answer after it.
    if (step.by_service || step.attempt != service.attempt || step.instance != service.instance) {
      continue;
    }
    if (step.stage == Stage::dispatched) {
      from = step.at;
    } else if (step.stage == Stage::replied || step.stage == Stage::late) {
      to = std::min(to, step.at);
    }
  }
  return std::clamp(service.at, from, std::max(from, to));
}

}  // namespace

Timeline timeline_of(const Call& call) {
  Timeline timeline{
      .call = call.id, .key = call.key, .uuid = call.uuid, .replayed = call.replayed, .steps = {}};
  std::vector<std::pair<fabric::Time, const Step*>> order;
  for (const Step& step : call.steps) {
    if (step.at == fabric::Time{}) {
      continue;
    }
    const fabric::Time place = place_of(call, step);
    order.emplace_back(place, &step);
    if (std::chrono::abs(place - step.at) > std::chrono::abs(timeline.clock_difference)) {
      timeline.clock_difference = place - step.at;
    }
  }
  std::ranges::stable_sort(
      order, {}, [](const auto& stage) { return std::pair(stage.first, stage.second->stage); });
  for (const auto& [place, step] : order) {
    timeline.steps.push_back(*step);
  }
  return timeline;
}

}  // namespace millrace::tools::recording
