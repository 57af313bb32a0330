#include "tests/simulation/gateway/ads_link.hpp"

#include <algorithm>
#include <utility>

#include "tests/simulation/gateway/ads_link_request.hpp"

namespace millrace::tests::simulation {

using gateway::Variable;
using gateway::WriteOutcome;

namespace {

/// cnc/ads/client.hpp
constexpr Time timeout = 2000ms;
/// Nothing of an old connection is executed later than this after its end; connecting takes longer.
constexpr Time leftovers = 60ms;

}  // namespace

AdsLink::AdsLink(Process& process, GatewayNumber gateway, Controller& controller,
                 LinkConditions& conditions, std::vector<std::uint16_t> channels,
                 gateway::machines::ControllerEvents& events, LinkObserver& observer,
                 History& history, Random random)
    : process_(process),
      gateway_(gateway),
      controller_(controller),
      conditions_(conditions),
      channels_(std::move(channels)),
      events_(events),
      observer_(observer),
      history_(history),
      random_(random),
      back_off_(static_cast<std::uint32_t>(random_.next())) {}

void AdsLink::abandon() {
  abandoned_ = true;
  stop_notifying();
  up_ = false;
  ++connection_;
  for (const RequestPointer& request : std::exchange(pending_, {})) {
    request->settled = true;
  }
  leave_to_controller();
}

/// What is already sent may still be executed, or not.
void AdsLink::leave_to_controller() {
  Time at = process_.agenda().now();
  for (const RequestPointer& request : std::exchange(queued_, {})) {
    process_.agenda().touches(controller_.parties());
    if (random_.chance(50)) {
      request->dropped = true;
      continue;
    }
    at += random_.between(Time{}, (process_.agenda().now() + leftovers - at) / 2);
    process_.agenda().at(at, {.parties = controller_.parties(), .means = meaning(*request, "left")},
                         [self = shared_from_this(), request] {
                           --self->controller_.leftovers[self->gateway_];
                           self->execute(request);
                         });
    ++controller_.leftovers[gateway_];
  }
}

Time AdsLink::delay() {
  return random_.between(conditions_.delay_least, conditions_.delay_most);
}

void AdsLink::start() {
  process_.after(Time{}, [self = shared_from_this()] { self->connect(); });
}

void AdsLink::connect() {
  if (abandoned_) {
    return;
  }
  const std::uint64_t connection = ++connection_;
  const bool refused = !controller_.powered() && !conditions_.silent && conditions_.plugged;
  const Time until =
      refused ? 1ms : (conditions_.plugged && !conditions_.silent ? 4 * delay() : 3000ms);
  // Connecting, the first ReadState, and the survey of the channels.
  process_.after_reading(controller_.parties(), until, [self = shared_from_this(), connection] {
    if (self->connection_ != connection) {
      return;
    }
    if (self->controller_.leftovers[self->gateway_] > 0) {
      self->wait_and_connect();
    } else if (self->controller_.powered() && self->conditions_.plugged &&
               !self->conditions_.silent) {
      self->came_up();
    } else {
      self->wait_and_connect();
    }
  });
}

void AdsLink::wait_and_connect() {
  const Time lasted = up_since_ ? process_.agenda().now() - *up_since_ : Time{};
  up_since_.reset();
  process_.timer(back_off_.next(lasted), [self = shared_from_this()] {
    if (!self->up_ && !self->abandoned_) {
      self->connect();
    }
  });
}

void AdsLink::came_up() {
  up_ = true;
  silent_timeouts_ = 0;
  controller_life_ = controller_.life();
  last_execution_ = process_.agenda().now();
  up_since_ = process_.agenda().now();
  history_.note(controller_.name(), "link up");
  events_.on_link_up(controller_.name(), channels_.empty() ? controller_.numbers() : channels_);
}

void AdsLink::cut(const std::string& reason) {
  if (!up_) {
    return;
  }
  up_ = false;
  ++connection_;
  stop_notifying();
  history_.note(controller_.name(), "link down: " + reason);
  const auto pending = std::exchange(pending_, {});
  for (const RequestPointer& request : pending) {
    request->settled = true;
  }
  leave_to_controller();
  const bool reason_first = random_.chance(50);
  process_.after(Time{}, [self = shared_from_this(), pending, reason, reason_first] {
    if (self->abandoned_) {
      return;
    }
    if (reason_first) {
      self->events_.on_link_down(self->controller_.name(), reason);
    }
    for (const RequestPointer& request : pending) {
      self->fail(*request, false);
    }
    if (self->abandoned_) {
      return;
    }
    if (!reason_first) {
      self->events_.on_link_down(self->controller_.name(), reason);
    }
    self->wait_and_connect();
  });
}

void AdsLink::refuse_unsent(std::uint16_t channel, bool is_write) {
  process_.after(Time{}, [self = shared_from_this(), channel, is_write] {
    const Key key{self->controller_.name(), channel};
    if (self->abandoned_) {
      return;
    }
    if (is_write) {
      self->events_.on_write(key, WriteOutcome::refused, "link down");
    } else {
      self->events_.on_read_failed(key, "");
    }
  });
}

void AdsLink::read(std::uint16_t channel, gateway::ReadSet set) {
  if (!up_) {
    refuse_unsent(channel, false);
    return;
  }
  auto request = std::make_shared<Request>();
  request->channel = channel;
  request->snapshot.set = set;
  const auto variables = gateway::variables_of(set);
  request->variables.assign(variables.begin(), variables.end());
  send(request);
}

void AdsLink::write(std::uint16_t channel, Variable variable, const gateway::Value& value) {
  if (!up_) {
    refuse_unsent(channel, true);
    return;
  }
  auto request = std::make_shared<Request>();
  request->channel = channel;
  request->write = observer_.describe({controller_.name(), channel}, variable, value);
  request->write->read = reads_[channel];
  send(request);
}

void AdsLink::ask(Work work) {
  auto request = std::make_shared<Request>();
  request->work = std::move(work);
  if (up_) {
    send(request);
  } else {
    process_.after(Time{}, [self = shared_from_this(), request] { self->fail(*request, false); });
  }
}

void AdsLink::send(const RequestPointer& request) {
  request->connection = connection_;
  request->controller_life = controller_life_;
  request->dropped = conditions_.silent || random_.chance(conditions_.lost);
  request->refused = random_.chance(conditions_.refused);
  pending_.push_back(request);
  if (!request->dropped) {
    queued_.push_back(request);
  }
  const Time now = process_.agenda().now();
  last_execution_ = std::max(now + delay(), last_execution_);
  process_.agenda().at(last_execution_,
                       {.parties = controller_.parties(), .means = meaning(*request, "execute")},
                       [self = shared_from_this(), request] { self->execute(request); });
  process_.timer(timeout, [self = shared_from_this(), request] { self->timed_out(request); });
}

}  // namespace millrace::tests::simulation
