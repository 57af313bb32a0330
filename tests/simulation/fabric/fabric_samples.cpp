// The delivery of requests and replies.
#include <algorithm>
#include <utility>

#include "tests/simulation/fabric/fabric.hpp"

namespace millrace::tests::simulation {

bool Fabric::publish(EndNumber number, const fabric::Request& request) {
  End& end = *ends_[number];
  const auto writer = end.requests.find(request.assigned);
  if (writer == end.requests.end()) {
    return false;
  }
  writer->second.samples[key_of(request)] = {++writer->second.last, request};
  lay_out(end, request.call, request.attempt, request.assigned, writer->second.last);
  for (const PairPointer& pair : pairs_of(number)) {
    send_requests(pair);
    if (ends_[pair->instance]->identity.id == request.assigned && !pair->of_instance.passes) {
      lose_after_request(pair);
    }
  }
  return true;
}

void Fabric::lose_after_request(const PairPointer& pair) {
  agenda_.after(random_.between(conditions.lease * 4 / 5, conditions.lease * 6 / 5),
                {.parties = parties(*pair), .timer = true},
                [this, pair, epoch = pair->of_instance.epoch] {
                  if (pair->of_instance.epoch == epoch) {
                    lose_known(pair, true);
                  }
                });
}

void Fabric::withdraw(EndNumber number, const fabric::RequestKey& key) {
  End& end = *ends_[number];
  const auto writer = end.requests.find(key.instance);
  if (writer == end.requests.end()) {
    return;
  }
  // Also samples that an earlier run of this gateway has left there.
  auto& sample = writer->second.samples[key];
  if (sample.number != 0 && !sample.value) {
    return;
  }
  sample = {++writer->second.last, std::nullopt};
  lay_out(end, {}, 0, key.instance, writer->second.last);
  for (const PairPointer& pair : pairs_of(number)) {
    send_requests(pair);
  }
}

void Fabric::heartbeat(EndNumber number, const fabric::InstanceLoad& load) {
  for (const PairPointer& pair : pairs_of(number)) {
    if (!pair->of_instance.passes || random_.chance(conditions.lost)) {
      continue;
    }
    within(pair, delay(false), [this, pair, load] {
      End& gateway = *ends_[pair->gateway];
      if (gateway.there && pair->of_instance.passes && pair->of_instance.reader) {
        gateway.process->run(gateway.life, [&gateway, load] { gateway.gateway->on_load(load); });
      }
    });
  }
}

void Fabric::publish(EndNumber number, const fabric::Reply& reply) {
  End& end = *ends_[number];
  auto& writer = end.replies;
  writer.samples[{key_of(reply), reply.instance}] = {++writer.last, reply};
  lay_out(end, reply.call, reply.state, reply.instance, writer.last);
  for (const PairPointer& pair : pairs_of(number)) {
    send_replies(pair);
  }
}

void Fabric::lay_out(const End& end, const fabric::CallId& call, std::uint32_t what,
                     const fabric::InstanceId& instance, std::uint64_t number) {
  if (const auto sample = agenda_.meaning(call.to_string(), what, instance.to_string(), number)) {
    agenda_.becomes(end.process->outbox(), *sample);
  }
}

void Fabric::send_requests(const PairPointer& pair, bool again) {
  const auto& writers = ends_[pair->gateway]->requests;
  const auto writer = writers.find(ends_[pair->instance]->identity.id);
  const bool news = writer != writers.end() && writer->second.last > pair->requests;
  if (news && !std::exchange(pair->requests_due, true)) {
    fetch(pair->instance, pair->gateway, delay(again), [this, pair] {
      pair->requests_due = false;
      arrive_requests(pair);
    });
  }
}

void Fabric::send_replies(const PairPointer& pair, bool again) {
  const bool news = ends_[pair->instance]->replies.last > pair->replies;
  if (news && !std::exchange(pair->replies_due, true)) {
    fetch(pair->gateway, pair->instance, delay(again), [this, pair] {
      pair->replies_due = false;
      arrive_replies(pair);
    });
  }
}

void Fabric::arrive_requests(const PairPointer& pair) {
  End& gateway = *ends_[pair->gateway];
  End& instance = *ends_[pair->instance];
  if (!gateway.there || !instance.there || !pair->of_instance.reader || !pair->of_gateway.reader ||
      !pair->of_gateway.passes) {
    return;
  }
  const auto writer = gateway.requests.find(instance.identity.id);
  if (writer == gateway.requests.end()) {
    return;
  }
  const bool fresh = pair->requests == 0;
  bool news = false;
  for (auto& [key, sample] : writer->second.samples) {
    if (sample.number <= pair->requests || (fresh && !sample.value)) {
      continue;
    }
    Cached& cached = instance.requests_in[key];
    if (sample.value) {
      cached = {*sample.value, InstanceState::alive};
      instance.requested_by[key].insert(pair->gateway);
    } else {
      cached.instance_state = InstanceState::disposed;
      instance.requested_by[key].erase(pair->gateway);
    }
    news = true;
  }
  pair->requests = writer->second.last;
  if (news) {
    wake_to_take_requests(pair->instance);
  }
}

/// A gateway's requests have no writer any more, unless another gateway with its journal publishes
/// them too.
void Fabric::orphan(EndNumber number, EndNumber gateway) {
  End& instance = *ends_[number];
  bool news = false;
  for (auto& [key, gateways] : instance.requested_by) {
    if (gateways.erase(gateway) > 0 && gateways.empty()) {
      instance.requests_in[key].instance_state = InstanceState::no_writers;
      news = true;
    }
  }
  std::erase_if(instance.requested_by,
                [](const auto& requester) { return requester.second.empty(); });
  if (news && instance.there) {
    wake_to_take_requests(number);
  }
}

void Fabric::wake_to_take_requests(EndNumber number) {
  End& instance = *ends_[number];
  if (std::exchange(instance.drain_due, true)) {
    return;
  }
  agenda_.after(random_.between(Time{}, 300us),
                {.parties = instance.process->parties(),
                 .means = agenda_.meaning("take requests", number),
                 .lives = {.first = &instance.process->life()}},
                [this, number] {
                  End& end = *ends_[number];
                  end.process->run(end.life, [this, number] { take_requests(number); });
                });
}

void Fabric::take_requests(EndNumber number) {
  End& end = *ends_[number];
  end.drain_due = false;
  for (const auto& [key, cached] : std::exchange(end.requests_in, {})) {
    switch (cached.instance_state) {
      // The request may be here too, not taken yet: a disposal, or the loss of its writer,
      // overtakes it.
      case InstanceState::disposed:
        end.instance->on_withdrawn(key);
        break;
      case InstanceState::no_writers:
        end.instance->on_orphaned(key);
        break;
      case InstanceState::alive:
        end.instance->on_request(cached.value);
        break;
    }
  }
}

void Fabric::arrive_replies(const PairPointer& pair) {
  End& gateway = *ends_[pair->gateway];
  End& instance = *ends_[pair->instance];
  if (!gateway.there || !pair->of_instance.writer || !pair->of_gateway.writer ||
      !pair->of_instance.passes) {
    return;
  }
  bool news = false;
  for (auto& [key, sample] : instance.replies.samples) {
    if (sample.number > pair->replies) {
      gateway.replies_in[{key, pair->instance}] = *sample.value;
      news = true;
    }
  }
  pair->replies = instance.replies.last;
  if (news) {
    agenda_.after(random_.between(Time{}, 300us),
                  {.parties = gateway.process->inbox(),
                   .reads = gateway.process->parties(),
                   .means = agenda_.meaning("take replies", pair->gateway),
                   .lives = {.first = &gateway.process->life()}},
                  [this, number = pair->gateway] {
                    End& end = *ends_[number];
                    end.process->run(end.life, [this, number] { take_replies(number); });
                  });
  }
}

void Fabric::take_replies(EndNumber number) {
  End& end = *ends_[number];
  if (!end.replies_in.empty()) {
    agenda_.touches(end.process->parties());
  }
  for (const auto& [key, reply] : std::exchange(end.replies_in, {})) {
    // The same decision as in fabric::endpoints::CallEndpoint.
    if (end.registry.speaks_for(writer_of(key.second), reply.instance)) {
      end.gateway->on_reply(reply);
    } else {
      end.gateway->on_stranger(reply);
    }
  }
}

}  // namespace millrace::tests::simulation
