#include "tests/simulation/values/value_user.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace millrace::tests::simulation {

namespace {

constexpr Time patience = 300ms;
/// A value read this long before the question also counts (gateway/variables/write_rules.hpp).
constexpr Time cycle = 2ms;
/// Values are rounded down to milliseconds.
constexpr Time cut = 1ms;
/// The greatest age of a sample: the duration of its request, on a link that is slow or silent for
/// a while.
constexpr Time oldest_sample = 2500ms;
/// Without faults: the time until a link is given up whose controller was restarted unnoticed, and
/// a new one is established.
constexpr Time longest_silence = 12s;

}  // namespace

ValueUser::ValueUser(Plant& plant, Random random) : plant_(plant), random_(random) {
  for (const auto& gateway : plant_.gateways()) {
    gateway->on_variable_reply = [this](const auto& reply) { on_reply(reply); };
    gateway->on_sample = [this](const auto& sample, Time stood_still) {
      on_sample(sample, stood_still);
    };
  }
}

template <typename... Arguments>
void ValueUser::violated(const char* what, const Arguments&... arguments) {
  plant_.history().violated(fmt::format(fmt::runtime(what), arguments...));
}

void ValueUser::start() {
  ask();
  watch();
}

void ValueUser::ask() {
  GatewayProcess& gateway = *random_.pick(plant_.gateways());
  const Controller& controller = *random_.pick(plant_.controllers());
  const Key key{controller.name(),
                static_cast<std::uint16_t>(1 + random_.below(controller.size()))};
  if (gateway.running() && !gateway.frozen()) {
    Open open;
    open.gateway = gateway.number();
    open.life = gateway.life();
    open.times_left = gateway.times_left(key);
    open.asked = plant_.agenda().now();
    open.calm =
        calm_ && gateway.serves(key) && open.asked >= plant_.conditions_of(controller).late_until;
    fabric::VariableRequest& request = open.request;
    for (std::uint8_t& byte : request.token.bytes) {
      byte = static_cast<std::uint8_t>(random_.next());
    }
    request.key = key;
    request.patience = patience;
    if (random_.chance(30)) {
      open.number = ++last_number_;
      request.action = fabric::VariableAction::write;
      request.names = {"V.E.NUMBER"};
      request.values = {{std::to_string(open.number)}};
    } else {
      request.names = {"V.E.TIME"};
    }
    const fabric::VariableRequest asked = request;
    open_.emplace(asked.token, std::move(open));
    expect_reply(asked.token);
    gateway.ask(asked);
  }
  plant_.agenda().after(random_.mostly(5ms, 100ms, 500ms, 30), {}, [this] { ask(); });
}

void ValueUser::expect_reply(const fabric::InstanceId& token) {
  plant_.agenda().after(2 * patience, {}, [this, token] {
    const Open asked = open_.extract(token).mapped();
    const GatewayProcess& gateway = *plant_.gateways().at(asked.gateway);
    if (asked.calm && !asked.answered && gateway.life() == asked.life &&
        gateway.serves(asked.request.key) &&
        gateway.times_left(asked.request.key) == asked.times_left) {
      violated("V1: gateway {} has not answered a question about variables of {}", asked.gateway,
               asked.request.key.to_string());
    }
  });
}

void ValueUser::on_reply(const fabric::VariableReply& reply) {
  const auto found = open_.find(reply.token);
  if (found == open_.end()) {
    // The client has stopped waiting.
    return;
  }
  const Open& open = found->second;
  if (std::exchange(found->second.answered, true)) {
    violated("V1: a question about variables of {} is answered twice",
             open.request.key.to_string());
  }
  const auto& controller =
      *std::ranges::find(plant_.controllers(), open.request.key.machine,
                         [](const auto& machine) -> const std::string& { return machine->name(); });
  const bool writes = open.request.action == fabric::VariableAction::write;
  const unsigned times = writes ? controller->values().times_written(open.number) : 0;
  if (times > 1 || (writes && reply.done && times == 0)) {
    violated("V2: {} of {} was written {} times for one question that was answered \"{}\"",
             open.number, open.request.key.to_string(), times, reply.done ? "done" : reply.reason);
  }
  if (!writes && reply.done) {
    const Time came = open.asked - cycle;
    judge_age(reply.results.at(0).value, came - controller->values().longest_way_since(came) - cut,
              open.request.key.to_string());
  }
}

void ValueUser::judge_age(const fabric::Value& value, Time oldest, const std::string& what) {
  if (value.quality != fabric::Quality::good) {
    return;
  }
  const Time read =
      std::chrono::milliseconds(std::get<std::vector<std::int64_t>>(value.elements).at(0));
  if (read < oldest || read > plant_.agenda().now()) {
    violated("V3: a value of {} is of {} ms, and was wanted as of {} ms", what,
             read / std::chrono::milliseconds(1), oldest / std::chrono::milliseconds(1));
  }
}

void ValueUser::on_sample(const fabric::DataSample& sample, Time stood_still) {
  for (const fabric::Value& value : sample.values) {
    judge_age(value, plant_.agenda().now() - oldest_sample - stood_still, sample.key.to_string());
    if (value.quality == fabric::Quality::good) {
      published_[sample.key.machine] = plant_.agenda().now();
    }
  }
}

void ValueUser::watch() {
  for (const auto& controller : plant_.controllers()) {
    const Key key{controller->name(), 1};
    const bool is_served = std::ranges::any_of(plant_.gateways(), [&](const auto& gateway) {
      const auto& machines = gateway->file().machines;
      const auto machine =
          std::ranges::find(machines, key.machine, &gateway::settings::MachineSettings::name);
      return gateway->running() && !gateway->frozen() && gateway->serves(key) &&
             machine != machines.end() && !machine->data.groups.empty();
    });
    Time& last_published = published_[key.machine];
    if (!calm_ || !is_served) {
      last_published = plant_.agenda().now();
    } else if (plant_.agenda().now() - last_published > longest_silence) {
      violated("V4: the data of {} are not told any more", key.machine);
      last_published = plant_.agenda().now();
    }
  }
  plant_.agenda().after(100ms, {}, [this] { watch(); });
}

}  // namespace millrace::tests::simulation
