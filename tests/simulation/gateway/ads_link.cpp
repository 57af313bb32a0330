#include "tests/simulation/gateway/ads_link.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace millrace::tests::simulation {
using gateway::Variable;
using gateway::WriteOutcome;

/// A request of a gateway to a controller, on its way there and back.
struct AdsLink::Request {
  std::uint16_t channel = 0;
  std::optional<Work> work;
  std::optional<AdsWrite> write;
  gateway::ServiceSnapshot snapshot;
  std::vector<gateway::Variable> variables;
  Time first{};
  bool refused = false;
  /// The controller will never execute it.
  bool dropped = false;
  bool executed = false;
  /// The gateway knows the result.
  bool settled = false;
  std::uint64_t connection = 0;
  std::uint64_t answers_before = 0;
  std::uint64_t controller_life = 0;
};

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
  const bool answers = !conditions_.silent || conditions_.router_refuses;
  const Time until = refused ? 1ms : (conditions_.plugged && answers ? 4 * delay() : 3000ms);
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
  answered_in_time_ = process_.agenda().now();
  router_refuses_since_.reset();
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
      self->events_.on_link_down(self->controller_.name(), fabric::Message(reason));
    }
    for (const RequestPointer& request : pending) {
      self->fail(*request, false);
    }
    if (self->abandoned_) {
      return;
    }
    if (!reason_first) {
      self->events_.on_link_down(self->controller_.name(), fabric::Message(reason));
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
  request->answers_before = answers_;
  request->controller_life = controller_life_;
  request->dropped = conditions_.silent || random_.chance(conditions_.lost);
  request->refused = random_.chance(conditions_.refused);
  pending_.push_back(request);
  if (!request->dropped) {
    queued_.push_back(request);
  } else if (conditions_.silent && conditions_.router_refuses) {
    later(delay(), &AdsLink::refused_by_router, request);
  }
  const Time now = process_.agenda().now();
  last_execution_ = std::max(now + delay(), last_execution_);
  process_.agenda().at(last_execution_,
                       {.parties = controller_.parties(), .means = meaning(*request, "execute")},
                       [self = shared_from_this(), request] { self->execute(request); });
  process_.timer(timeout, [self = shared_from_this(), request] { self->timed_out(request); });
}

// What a controller does with a request, and how the gateway gets the response.

namespace {

/// Without a response in time; cnc/ads/client.hpp.
constexpr Time longest_without_response = 3 * timeout;

void put(gateway::ServiceSnapshot& snapshot, Variable variable, gateway::Value value) {
  switch (variable) {
    case Variable::uuid:
      snapshot.uuid = std::get<std::string>(std::move(value));
      break;
    case Variable::request:
      snapshot.request = std::get<std::string>(std::move(value));
      break;
    case Variable::request_state:
      snapshot.request_state = std::get<std::uint32_t>(value);
      break;
    case Variable::response_state:
      snapshot.response_state = std::get<std::uint32_t>(value);
      break;
    case Variable::response:
      snapshot.response = std::get<std::string>(std::move(value));
      break;
  }
}

std::string words_for(const gateway::Value& value) {
  return std::visit([](const auto& content) { return fmt::format("{}", content); }, value);
}

}  // namespace

std::optional<Meaning> AdsLink::meaning(const Request& request, const char* step) const {
  const gateway::ServiceSnapshot& snapshot = request.snapshot;
  return process_.agenda().meaning(
      step, request.channel, request.write ? request.write->call.to_string() : "",
      request.write ? static_cast<int>(request.write->variable) : -1,
      request.write ? words_for(request.write->value) : "", request.variables.size(),
      static_cast<int>(snapshot.set), snapshot.uuid, snapshot.request, snapshot.request_state,
      snapshot.response_state, snapshot.response, request.refused, request.dropped,
      request.executed);
}

void AdsLink::later(Time delay, void (AdsLink::*act)(const RequestPointer&),
                    const RequestPointer& request) {
  process_.agenda().after(delay,
                          {.parties = process_.parties(),
                           .means = meaning(*request, "answer"),
                           .lives = {.first = &process_.life()}},
                          [self = weak_from_this(), act, request, life = process_.life()] {
                            if (const auto link = self.lock()) {
                              link->process_.run(
                                  life, [link, act, request] { (link.get()->*act)(request); });
                            }
                          });
}

void AdsLink::execute(const RequestPointer& request) {
  const bool there = controller_.powered() && controller_.life() == request->controller_life;
  if (request->dropped || !there || request->executed) {
    return;
  }
  std::erase(queued_, request);
  if (request->refused) {
    request->executed = true;
    answer(request, delay());
    return;
  }
  if (request->work) {
    request->executed = true;
    request->work->carry_out();
    answer(request, delay());
    return;
  }
  if (!request->write) {
    request->executed = true;
    request->first = process_.agenda().now();
    sample(request, 0);
    return;
  }
  request->executed = true;
  // A separate random source, so that the rest of a seed keeps its meaning. Where a kernel clears
  // REQUEST_STATE late after an interim state, no gateway can detect that a release was lost.
  if (conditions_.writes.lost > 0 && !controller_.kernel_clears() &&
      Random(~random_.state()).chance(conditions_.writes.lost)) {
    history_.note(Key{controller_.name(), request->channel}.to_string(), "a write is lost");
    controller_.channel(request->channel).set_lost_by(gateway_);
    answer(request, delay());
    return;
  }
  Time& effective = controller_.effective[{request->channel, request->write->variable}];
  const Time now = process_.agenda().now();
  effective = std::max(effective, now + conditions_.writes.delay_of(request->write->variable));
  const Time late = effective - now;
  if (late == Time{}) {
    apply(request);
  } else {
    // Acknowledged first; the controller applies it whatever happens to the connection.
    process_.agenda().after(
        late, {.parties = controller_.parties(), .means = meaning(*request, "apply")},
        [self = shared_from_this(), request] {
          if (self->controller_.powered() && self->controller_.life() == request->controller_life) {
            self->apply(request);
          }
        });
  }
  answer(request, delay());
}

void AdsLink::apply(const RequestPointer& request) {
  MachineChannel& channel = controller_.channel(request->channel);
  const AdsWrite& write = *request->write;
  const bool crosses =
      channel.moved_on_since(write.read, gateway_) || channel.standing() != write.request;
  channel.crossed = channel.crossed || crosses;
  request->refused = !channel.write(write.variable, write.value);
  if (request->refused) {
    return;
  }
  channel.writers.insert(gateway_);
  if (write.answer) {
    channel.set_lost_by({});
  }
  // A kernel that clears REQUEST_STATE itself is about to do so.
  const std::uint32_t request_state =
      channel.rules().kernel_clears_after ? 0 : channel.state(Variable::request_state);
  history_.add(WriteDone{gateway_, channel.key(), write.call, write.request, write.variable,
                         write.answer, write.value, channel.text(Variable::response), request_state,
                         crosses});
  if (const auto clears_after = channel.rules().kernel_clears_after) {
    process_.agenda().after(*clears_after,
                            {.parties = controller_.parties(), .means = meaning(*request, "clear")},
                            [&channel] { channel.advance(); });
  }
}

void AdsLink::sample(const RequestPointer& request, std::size_t next) {
  const bool there = controller_.powered() && controller_.life() == request->controller_life;
  if (!there) {
    return;
  }
  const Variable variable = request->variables[next];
  put(request->snapshot, variable, controller_.channel(request->channel).read(variable));
  if (next + 1 == request->variables.size()) {
    answer(request, delay());
    return;
  }
  // Variable by variable, so a program may write in between.
  process_.agenda().after(
      random_.between(Time{}, 500us),
      {.parties = controller_.parties(), .means = meaning(*request, "sample")},
      [self = shared_from_this(), request, next] { self->sample(request, next + 1); });
}

void AdsLink::answer(const RequestPointer& request, Time delay) {
  later(delay, &AdsLink::answered, request);
}

void AdsLink::answered(const RequestPointer& request) {
  if (conditions_.silent || request->connection != connection_) {
    return;
  }
  ++answers_;
  router_refuses_since_.reset();
  if (request->settled) {
    return;
  }
  request->settled = true;
  answered_in_time_ = process_.agenda().now();
  std::erase(pending_, request);
  if (request->work) {
    request->work->on_answer(request->refused ? "the controller refuses it" : "");
    return;
  }
  const Key key{controller_.name(), request->channel};
  if (request->write) {
    events_.on_write(key, request->refused ? WriteOutcome::refused : WriteOutcome::written,
                     request->refused ? "the controller refuses it" : "");
  } else if (request->refused) {
    events_.on_read_failed(key, "the controller refuses it");
  } else {
    reads_[request->channel] = request->first;
    observer_.on_looked(request->first);
    events_.on_read(key, request->snapshot);
  }
}

// No answer of the controller: the connection ends when nothing else has come for a timeout.
void AdsLink::refused_by_router(const RequestPointer& request) {
  if (abandoned_ || request->connection != connection_ || request->settled) {
    return;
  }
  request->settled = true;
  std::erase(pending_, request);
  const Time now = process_.agenda().now();
  router_refuses_since_ = router_refuses_since_.value_or(now);
  if (request->work) {
    request->work->on_answer("the router refuses it");
  } else if (const Key key{controller_.name(), request->channel}; request->write) {
    events_.on_write(key, WriteOutcome::refused, "the router refuses it");
  } else {
    events_.on_read_failed(key, "the router refuses it");
  }
  if (now - *router_refuses_since_ >= timeout && !abandoned_) {
    cut("its router does not reach it");
  }
}

void AdsLink::timed_out(const RequestPointer& request) {
  if (request->settled) {
    return;
  }
  request->settled = true;
  std::erase(pending_, request);
  const bool too_silent = answers_ == request->answers_before ||
                          process_.agenda().now() - answered_in_time_ >= longest_without_response;
  fail(*request, true);
  if (too_silent && !abandoned_) {
    cut("it does not answer any more");
  }
}

void AdsLink::fail(const Request& request, bool timed_out) {
  if (abandoned_) {
    return;
  }
  if (request.work) {
    request.work->on_answer(timed_out ? "timeout" : "link lost");
    return;
  }
  const Key key{controller_.name(), request.channel};
  if (request.write) {
    events_.on_write(key, WriteOutcome::unknown, timed_out ? "timeout" : "link lost");
  } else {
    events_.on_read_failed(key, timed_out ? "the controller does not answer" : "");
  }
}

}  // namespace millrace::tests::simulation
