// What a controller does with a request, and how the gateway gets the response.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "tests/simulation/gateway/ads_link_request.hpp"

namespace millrace::tests::simulation {

using gateway::Variable;
using gateway::WriteOutcome;

namespace {

/// cnc/ads/client.hpp
constexpr unsigned most_silent_timeouts = 3;

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
  return std::visit([](const auto& one) { return fmt::format("{}", one); }, value);
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
  if (request->settled || conditions_.silent) {
    return;
  }
  request->settled = true;
  silent_timeouts_ = 0;
  std::erase(pending_, request);
  if (request->work) {
    request->work->told(request->refused ? "the controller refuses it" : "");
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

void AdsLink::fail(const Request& request, bool timed_out) {
  if (abandoned_) {
    return;
  }
  if (request.work) {
    request.work->told(timed_out ? "timeout" : "link lost");
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
