#include "tools/recording/timeline.hpp"

#include <algorithm>
#include <array>

namespace millrace::tools::recording {

namespace {

Stage stage_of(fabric::EventKind kind) {
  switch (kind) {
    case fabric::EventKind::seen:
      return Stage::seen;
    case fabric::EventKind::unserved:
      return Stage::unserved;
    case fabric::EventKind::dispatched:
      return Stage::dispatched;
    case fabric::EventKind::interim:
      return Stage::interim;
    case fabric::EventKind::replied:
      return Stage::replied;
    case fabric::EventKind::written:
      return Stage::written;
    case fabric::EventKind::withdrawn:
      return Stage::withdrawn;
    case fabric::EventKind::lost:
      return Stage::lost;
    case fabric::EventKind::late:
      return Stage::late;
    case fabric::EventKind::refused:
      return Stage::refused;
    case fabric::EventKind::held:
      return Stage::held;
  }
  return Stage::seen;
}

/// The limits of a service's times on the gateway's clock.
struct Bounds {
  fabric::Time from = fabric::Time::min();
  fabric::Time to = fabric::Time::max();
};

Bounds bounds_of(const Timeline& timeline, const TimelineStep& service) {
  Bounds bounds;
  for (const TimelineStep& step : timeline.steps) {
    // An operator's answer to the attempt sets no limit: the service may answer after it.
    if (step.by_service || step.attempt != service.attempt || step.instance != service.instance) {
      continue;
    }
    if (step.stage == Stage::dispatched) {
      bounds.from = step.at;
    } else if (step.stage == Stage::replied || step.stage == Stage::late) {
      bounds.to = std::min(bounds.to, step.at);
    }
  }
  return bounds;
}

}  // namespace

std::string_view name_of(Stage stage) {
  constexpr std::array<std::string_view, 14> names{"seen by the gateway",
                                                   "no service has this UUID",
                                                   "dispatched",
                                                   "received by the instance",
                                                   "handler started",
                                                   "interim state shown",
                                                   "answered by the instance",
                                                   "reply at the gateway",
                                                   "reply refused",
                                                   "instance lost",
                                                   "held for an operator",
                                                   "late reply dropped",
                                                   "withdrawn by the program",
                                                   "written back"};
  return names.at(static_cast<std::size_t>(stage));
}

TimelineBuilder::TimelineBuilder(fabric::CallId call) {
  found_.call = call;
}

void TimelineBuilder::add(const Entry& entry) {
  if (call_of(entry) != found_.call) {
    return;
  }
  if (const auto* request = std::get_if<fabric::Request>(&entry.sample)) {
    add(*request, entry);
  } else if (const auto* reply = std::get_if<fabric::Reply>(&entry.sample)) {
    add(*reply, entry);
  } else if (const auto* event = std::get_if<fabric::Event>(&entry.sample)) {
    add(*event, entry);
  } else {
    return;
  }
  found_.key = *channel_of(entry);
  if (!entry.uuid.empty()) {
    found_.uuid = entry.uuid;
  }
}

void TimelineBuilder::add(const fabric::Request& request, const Entry& entry) {
  found_.replayed = found_.replayed || request.replayed;
  add({.stage = Stage::seen,
       .at = request.seen,
       .text = request.text,
       .withheld = entry.withheld,
       .state = request.state});
  add({.stage = Stage::dispatched,
       .at = request.dispatched,
       .attempt = request.attempt,
       .instance = request.assigned});
}

void TimelineBuilder::add(const fabric::Reply& reply, const Entry& entry) {
  const auto at_service = [&](Stage stage, fabric::Time at) {
    return TimelineStep{.stage = stage,
                        .at = at,
                        .attempt = reply.attempt,
                        .by_service = true,
                        .instance = reply.instance};
  };
  add(at_service(Stage::received, reply.received));
  add(at_service(Stage::started, reply.started));
  if (reply.kind == fabric::ReplyKind::final) {
    TimelineStep answered = at_service(Stage::answered, reply.answered);
    answered.text = reply.text;
    answered.withheld = entry.withheld;
    answered.state = reply.state;
    add(std::move(answered));
  }
}

void TimelineBuilder::add(const fabric::Event& event, const Entry& entry) {
  const Stage stage = stage_of(event.kind);
  const bool of_the_call = stage == Stage::seen;
  add({.stage = stage,
       .at = event.at,
       .attempt = of_the_call ? 0 : event.attempt,
       .instance = of_the_call ? fabric::InstanceId{} : event.instance,
       .text = event.text,
       .withheld = entry.withheld,
       .state = event.state,
       .detail = event.detail});
}

void TimelineBuilder::add(TimelineStep step) {
  if (step.at == fabric::Time{}) {
    return;
  }
  const auto same =
      std::find_if(found_.steps.begin(), found_.steps.end(), [&](const TimelineStep& known) {
        // Request and event get their times one after the other.
        return known.stage == step.stage && known.attempt == step.attempt &&
               (step.stage == Stage::seen || step.stage == Stage::dispatched ||
                known.at == step.at);
      });
  if (same == found_.steps.end()) {
    found_.steps.push_back(std::move(step));
  } else if (same->detail.empty()) {
    same->detail = step.detail;
  }
}

Timeline TimelineBuilder::build() const {
  Timeline timeline = found_;
  order_service_steps(timeline);
  return timeline;
}

void TimelineBuilder::order_service_steps(Timeline& timeline) const {
  // A service's step is placed where it must have been, and keeps its own time.
  const auto place = [&](const TimelineStep& step) {
    if (!step.by_service) {
      return step.at;
    }
    const Bounds bounds = bounds_of(found_, step);
    return std::clamp(step.at, bounds.from, std::max(bounds.from, bounds.to));
  };
  for (const TimelineStep& step : timeline.steps) {
    const auto shift = place(step) - step.at;
    if (std::chrono::abs(shift) > std::chrono::abs(timeline.clock_difference)) {
      timeline.clock_difference = shift;
    }
  }
  std::stable_sort(timeline.steps.begin(), timeline.steps.end(),
                   [&](const TimelineStep& a, const TimelineStep& b) {
                     const auto at_a = place(a);
                     const auto at_b = place(b);
                     return at_a != at_b ? at_a < at_b : a.stage < b.stage;
                   });
}

}  // namespace millrace::tools::recording
