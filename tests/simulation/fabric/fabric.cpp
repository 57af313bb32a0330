#include "tests/simulation/fabric/fabric.hpp"

#include <algorithm>
#include <utility>

namespace millrace::tests::simulation {

EndNumber Fabric::add(Process& process) {
  auto end = std::make_unique<End>();
  end->process = &process;
  end->life = process.life();
  ends_.push_back(std::move(end));
  return ends_.size() - 1;
}

EndNumber Fabric::join(Process& process, GatewayListener& listener, GatewayMonitorListener& watch) {
  const EndNumber number = add(process);
  ends_[number]->gateway = &listener;
  gateway_topics_.join(number, process, watch);
  for (EndNumber other = 0; other < number; ++other) {
    if (ends_[other]->there && ends_[other]->instance != nullptr) {
      pair_up(number, other);
    }
  }
  return number;
}

EndNumber Fabric::join(Process& process, InstanceListener& listener,
                       const fabric::InstanceIdentity& identity) {
  const EndNumber number = add(process);
  ends_[number]->instance = &listener;
  ends_[number]->identity = identity;
  for (EndNumber other = 0; other < number; ++other) {
    if (ends_[other]->there && ends_[other]->gateway != nullptr) {
      pair_up(other, number);
    }
  }
  return number;
}

void Fabric::pair_up(EndNumber gateway, EndNumber instance) {
  auto pair = std::make_shared<Pair>();
  pair->gateway = gateway;
  pair->instance = instance;
  pairs_.push_back(pair);
  refresh(pair);
}

std::vector<Fabric::PairPointer> Fabric::pairs_of(EndNumber end) const {
  std::vector<PairPointer> found;
  std::ranges::copy_if(pairs_, std::back_inserter(found), [&](const PairPointer& pair) {
    return pair->gateway == end || pair->instance == end;
  });
  return found;
}

std::vector<EndNumber> Fabric::ends() const {
  std::vector<EndNumber> found;
  for (EndNumber end = 0; end < ends_.size(); ++end) {
    if (ends_[end]->there) {
      found.push_back(end);
    }
  }
  return found;
}

void Fabric::leave(EndNumber end, bool told) {
  ends_[end]->there = false;
  if (ends_[end]->gateway != nullptr) {
    gateway_topics_.leave(end, told);
  }
  for (const PairPointer& pair : pairs_of(end)) {
    const bool is_instance = pair->instance == end;
    Side& side = is_instance ? pair->of_instance : pair->of_gateway;
    if (told && side.path && ends_[is_instance ? pair->gateway : pair->instance]->awake) {
      agenda_.touches(parties(*pair));
      // Its last samples arrive before the farewell.
      if (is_instance) {
        arrive_replies(pair);
      }
      ++side.epoch;
      side.heard = false;
      within(pair, delay(false), [this, pair, is_instance] { lose_known(pair, is_instance); });
    } else {
      refresh(pair);
    }
  }
}

void Fabric::frozen(EndNumber end) {
  ends_[end]->awake = false;
  if (ends_[end]->gateway != nullptr) {
    gateway_topics_.frozen(end);
  }
  for (const PairPointer& pair : pairs_of(end)) {
    refresh(pair);
  }
}

void Fabric::thawed(EndNumber end, Time after) {
  ends_[end]->awake = true;
  if (ends_[end]->gateway != nullptr) {
    gateway_topics_.thawed(end, after);
  }
  for (const PairPointer& pair : pairs_of(end)) {
    if (after > conditions.lease) {
      // It has received nothing from the others for longer than their leases.
      Side& other = pair->instance == end ? pair->of_gateway : pair->of_instance;
      lose_known(pair, pair->gateway == end);
      other.heard = false;
      ++other.epoch;
    }
    refresh(pair);
  }
}

void Fabric::set_path(EndNumber from, EndNumber to, bool open) {
  gateway_topics_.set_path(from, to, open);
  for (const PairPointer& pair : pairs_) {
    if (pair->instance == from && pair->gateway == to) {
      pair->of_instance.path = open;
      refresh(pair);
    } else if (pair->gateway == from && pair->instance == to) {
      pair->of_gateway.path = open;
      refresh(pair);
    }
  }
}

void Fabric::open_all_paths() {
  gateway_topics_.open_all_paths();
  for (const PairPointer& pair : pairs_) {
    pair->of_instance.path = true;
    pair->of_gateway.path = true;
    refresh(pair);
  }
}

std::uint64_t Fabric::parties(const Pair& pair) const {
  return hearing(*ends_[pair.gateway]) | hearing(*ends_[pair.instance]);
}

void Fabric::within(const PairPointer& pair, Time delay, std::function<void()> act) {
  agenda_.after(delay, {.parties = parties(*pair)}, std::move(act));
}

void Fabric::fetch(EndNumber reader, EndNumber writer, Time delay, std::function<void()> act) {
  const Process& to = *ends_[reader]->process;
  const Process& from = *ends_[writer]->process;
  agenda_.after(delay,
                {.parties = hearing(*ends_[reader]),
                 .reads = from.outbox(),
                 .means = agenda_.meaning("fetch", reader, writer),
                 .lives = {.first = &to.life(), .second = &from.life()}},
                std::move(act));
}

Time Fabric::delay(bool again) {
  if (again || random_.chance(conditions.lost)) {
    // The time to the next heartbeat and the repeated sample.
    return random_.between(10ms, 100ms);
  }
  return random_.between(conditions.delay_least, conditions.delay_most);
}

}  // namespace millrace::tests::simulation
