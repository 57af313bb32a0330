#include "tests/simulation/gateway/ads_link.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace millrace::tests::simulation {

using gateway::Variable;
using gateway::WriteOutcome;

namespace {

/// cnc/ads/client.hpp
constexpr Time timeout = 2000ms;
constexpr unsigned most_silent_timeouts = 3;
/// Nothing of an old connection is executed later than this after its end; a new one takes longer.
constexpr Time leftovers = 60ms;

void put(gateway::Snapshot& snapshot, Variable variable, gateway::Value value) {
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

gateway::queues::StepAnswer refusal_of(const gateway::queues::Step& step,
                                       const std::string& reason) {
  if (std::holds_alternative<gateway::queues::ReadControl>(step)) {
    return gateway::queues::Answer<gateway::queues::Control>(tl::unexpected(reason));
  }
  if (std::holds_alternative<gateway::queues::ReadQueue>(step)) {
    return gateway::queues::Answer<std::vector<std::string>>(tl::unexpected(reason));
  }
  return gateway::queues::Answer<void>(tl::unexpected(reason));
}

std::string words_for(const gateway::Value& value) {
  return std::visit([](const auto& one) { return fmt::format("{}", one); }, value);
}

}  // namespace

struct AdsLink::Request {
  std::uint16_t channel = 0;
  /// A question to a message queue, and who waits for its answer.
  MessageRing* ring = nullptr;
  gateway::queues::Step step;
  gateway::queues::StepAnswer found;
  MessageRing::Sight sight;
  std::function<void(gateway::queues::StepAnswer)> told;
  std::optional<AdsWrite> write;
  gateway::Snapshot snapshot;
  std::vector<Variable> variables;
  Time first{};
  bool refused = false;
  /// The controller will never do it.
  bool dropped = false;
  bool executed = false;
  /// The gateway knows how it ended.
  bool settled = false;
  std::uint64_t connection = 0;
  std::uint64_t controller_life = 0;
};

AdsLink::AdsLink(Process& process, GatewayNumber gateway, Controller& controller, Cable& cable,
                 std::vector<std::uint16_t> channels, gateway::machines::LinkEvents& events,
                 LinkObserver& observer, History& history, Random random)
    : process_(process),
      gateway_(gateway),
      controller_(controller),
      cable_(cable),
      channels_(std::move(channels)),
      events_(events),
      observer_(observer),
      history_(history),
      random_(random),
      back_off_(static_cast<std::uint32_t>(random_.next())) {}

void AdsLink::abandon() {
  abandoned_ = true;
  stop_telling();
  up_ = false;
  ++connection_;
  for (const RequestPointer& request : std::exchange(pending_, {})) {
    request->settled = true;
  }
  leave_to_controller();
}

/// What is sent already may still be done, or not.
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
  return random_.between(cable_.delay_least, cable_.delay_most);
}

std::optional<Meaning> AdsLink::meaning(const Request& request, const char* step) const {
  const gateway::Snapshot& snapshot = request.snapshot;
  return process_.agenda().meaning(
      step, request.channel, request.write ? request.write->call.to_string() : "",
      request.write ? static_cast<int>(request.write->variable) : -1,
      request.write ? words_for(request.write->value) : "", request.variables.size(),
      static_cast<int>(snapshot.look), snapshot.uuid, snapshot.request, snapshot.request_state,
      snapshot.response_state, snapshot.response, request.refused, request.dropped,
      request.executed);
}

void AdsLink::start() {
  process_.after(Time{}, [self = shared_from_this()] { self->connect(); });
}

void AdsLink::connect() {
  if (abandoned_) {
    return;
  }
  const std::uint64_t connection = ++connection_;
  const bool refused = !controller_.powered() && !cable_.silent && cable_.plugged;
  const Time until = refused ? 1ms : (cable_.plugged && !cable_.silent ? 4 * delay() : 3000ms);
  // Connect, the first ReadState, and the survey of the channels.
  process_.after_reading(controller_.parties(), until, [self = shared_from_this(), connection] {
    if (self->connection_ != connection) {
      return;
    }
    if (self->controller_.leftovers[self->gateway_] > 0) {
      self->wait_and_connect();
    } else if (self->controller_.powered() && self->cable_.plugged && !self->cable_.silent) {
      self->came_up();
    } else {
      self->wait_and_connect();
    }
  });
}

void AdsLink::wait_and_connect() {
  process_.timer(back_off_.next(), [self = shared_from_this()] {
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
  back_off_.reset();
  history_.note(controller_.name(), "link up");
  events_.on_link_up(controller_.name(), channels_.empty() ? controller_.numbers() : channels_);
}

void AdsLink::cut(const std::string& reason) {
  if (!up_) {
    return;
  }
  up_ = false;
  ++connection_;
  stop_telling();
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

void AdsLink::fail(const Request& request, bool timed_out) {
  if (abandoned_) {
    return;
  }
  if (request.ring != nullptr) {
    request.told(refusal_of(request.step, timed_out ? "timeout" : "link lost"));
    return;
  }
  const Key key{controller_.name(), request.channel};
  if (request.write) {
    events_.on_write(key, WriteOutcome::unknown, timed_out ? "timeout" : "link lost");
  } else {
    events_.on_read_failed(key, timed_out ? "the controller does not answer" : "");
  }
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

void AdsLink::read(std::uint16_t channel, gateway::ReadSet look) {
  if (!up_) {
    refuse_unsent(channel, false);
    return;
  }
  auto request = std::make_shared<Request>();
  request->channel = channel;
  request->snapshot.look = look;
  const auto variables = gateway::variables_of(look);
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
  send(request);
}

void AdsLink::ask(MessageRing& ring, const gateway::queues::Step& step,
                  std::function<void(gateway::queues::StepAnswer)> answered) {
  auto request = std::make_shared<Request>();
  request->ring = &ring;
  request->step = step;
  request->told = std::move(answered);
  if (up_) {
    send(request);
  } else {
    process_.after(Time{}, [self = shared_from_this(), request] { self->fail(*request, false); });
  }
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

void AdsLink::send(const RequestPointer& request) {
  request->connection = connection_;
  request->controller_life = controller_life_;
  request->dropped = cable_.silent || random_.chance(cable_.lost);
  request->refused = random_.chance(cable_.refused);
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
  if (request->ring != nullptr) {
    request->executed = true;
    carry_out(*request, gateway_);
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
  MachineChannel& channel = controller_.channel(request->channel);
  const AdsWrite& write = *request->write;
  channel.crossed = channel.crossed || channel.standing() != write.request;
  request->refused = !channel.write(write.variable, write.value);
  if (!request->refused) {
    history_.add(WriteDone{gateway_, channel.key(), write.call, write.request, write.variable,
                           write.answer, write.value, channel.text(Variable::response),
                           channel.state(Variable::request_state)});
  }
  answer(request, delay());
}

/// Each is done whole.
void AdsLink::carry_out(Request& request, GatewayNumber gateway) {
  MessageRing& ring = *request.ring;
  if (std::holds_alternative<gateway::queues::ReadControl>(request.step)) {
    request.found = gateway::queues::Answer<gateway::queues::Control>(ring.control());
    request.sight = ring.sight(gateway);
  } else if (std::holds_alternative<gateway::queues::ReadQueue>(request.step)) {
    request.found = gateway::queues::Answer<std::vector<std::string>>(ring.texts());
  } else {
    ring.write_last_get(std::get<gateway::queues::WriteLastGet>(request.step).element, gateway);
    request.found = gateway::queues::Answer<void>();
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
  // One after the other, so a program may write in between.
  process_.agenda().after(
      random_.between(Time{}, 500us),
      {.parties = controller_.parties(), .means = meaning(*request, "sample")},
      [self = shared_from_this(), request, next] { self->sample(request, next + 1); });
}

void AdsLink::answer(const RequestPointer& request, Time delay) {
  later(delay, &AdsLink::answered, request);
}

void AdsLink::answered(const RequestPointer& request) {
  if (request->settled || cable_.silent) {
    return;
  }
  request->settled = true;
  silent_timeouts_ = 0;
  std::erase(pending_, request);
  if (request->ring != nullptr) {
    if (request->refused) {
      request->told(refusal_of(request->step, "the controller refuses it"));
      return;
    }
    if (std::holds_alternative<gateway::queues::ReadControl>(request->step)) {
      request->ring->seen(gateway_, request->sight);
    }
    request->told(std::move(request->found));
    return;
  }
  const Key key{controller_.name(), request->channel};
  if (request->write) {
    events_.on_write(key, request->refused ? WriteOutcome::refused : WriteOutcome::written,
                     request->refused ? "the controller refuses it" : "");
  } else if (request->refused) {
    events_.on_read_failed(key, "the controller refuses it");
  } else {
    observer_.on_looked(request->first);
    events_.on_read(key, request->snapshot);
  }
}

void AdsLink::timed_out(const RequestPointer& request) {
  if (request->settled) {
    return;
  }
  request->settled = true;
  std::erase(pending_, request);
  const bool too_silent = ++silent_timeouts_ >= most_silent_timeouts;
  fail(*request, true);
  if (too_silent && !abandoned_) {
    cut("it does not answer any more");
  }
}

}  // namespace millrace::tests::simulation
