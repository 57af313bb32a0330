// How a controller notifies changes: it samples in the cycle of its task, and notifications keep
// their order. It may refuse or forget a subscription, be late, and send nothing.
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "tests/simulation/gateway/ads_link.hpp"

namespace millrace::tests::simulation {

using gateway::Variable;

namespace {

constexpr std::array notified_states{Variable::request_state, Variable::response_state};
/// For a lost request: cnc/ads/client.hpp.
constexpr Time question_timeout = 2000ms;

}  // namespace

bool AdsLink::still(std::uint64_t connection) const {
  return up_ && !abandoned_ && connection_ == connection;
}

void AdsLink::subscribe(const std::vector<std::uint16_t>& channels) {
  if (!up_) {
    return;
  }
  const bool lost = conditions_.silent || random_.chance(conditions_.lost);
  const bool refused = conditions_.notifications.refuses;
  std::map<std::uint16_t, std::uint64_t> asked;
  for (const std::uint16_t channel : channels) {
    asked[channel] = ++questions_[channel];
  }
  const auto answer = [self = shared_from_this(), channels, refused, lost,
                       connection = connection_] {
    if (!self->still(connection)) {
      return;
    }
    std::vector<gateway::machines::SubscribeOutcome> outcomes;
    for (const std::uint16_t channel : channels) {
      outcomes.push_back({channel,
                          lost      ? "no answer"
                          : refused ? "the controller refuses it"
                                    : "",
                          lost});
    }
    self->events_.on_subscribed(self->controller_.name(), outcomes);
  };
  if (lost || refused) {
    process_.timer(lost ? question_timeout : 2 * delay(), answer);
    return;
  }
  process_.agenda().after(delay(), {.parties = controller_.parties()},
                          [self = shared_from_this(), asked, connection = connection_, answer] {
                            if (!self->still(connection) || !self->controller_.powered()) {
                              return;
                            }
                            for (const auto& [channel, question] : asked) {
                              if (self->questions_[channel] == question) {
                                self->begin_notifying(channel);
                              }
                            }
                            const Time delay = self->delay();
                            self->last_notification_ = std::max(
                                self->last_notification_, self->process_.agenda().now() + delay);
                            self->process_.after(delay, answer);
                          });
}

void AdsLink::unsubscribe(const std::vector<std::uint16_t>& channels) {
  for (const std::uint16_t channel : channels) {
    ++questions_[channel];
    stop_notifying(channel);
  }
}

void AdsLink::begin_notifying(std::uint16_t channel) {
  subscriptions_[channel] = {};
  controller_.channel(channel).watchers[this] = [this, channel] { sample_later(channel); };
  sample_later(channel);
}

void AdsLink::sample_later(std::uint16_t channel) {
  Subscription& subscription = subscriptions_[channel];
  if (subscription.sampling) {
    return;
  }
  subscription.sampling = true;
  const Time now = process_.agenda().now();
  const Time cycle = conditions_.notifications.cycle;
  process_.agenda().at((now / cycle + 1) * cycle, {.parties = controller_.parties()},
                       [self = shared_from_this(), channel, connection = connection_] {
                         if (self->still(connection) && self->controller_.powered()) {
                           self->take_sample(channel);
                         }
                       });
}

void AdsLink::take_sample(std::uint16_t channel) {
  const auto found = subscriptions_.find(channel);
  if (found == subscriptions_.end()) {
    return;
  }
  Subscription& subscription = found->second;
  subscription.sampling = false;
  const NotificationBehaviour& behaviour = conditions_.notifications;
  for (const Variable variable : notified_states) {
    const std::uint32_t value = controller_.channel(channel).state(variable);
    const auto last = subscription.last.find(variable);
    const bool first = last == subscription.last.end();
    if (!first && last->second == value) {
      continue;
    }
    subscription.last[variable] = value;
    if (behaviour.silent || (behaviour.first_only && !first) || random_.chance(behaviour.lost)) {
      continue;
    }
    if (!first && random_.chance(behaviour.dropped)) {
      stop_notifying(channel);
      tell(channel, variable, std::nullopt);
      return;
    }
    tell(channel, variable, value);
  }
}

void AdsLink::tell(std::uint16_t channel, Variable variable, std::optional<std::uint32_t> value) {
  if (conditions_.silent) {
    return;
  }
  const Time now = process_.agenda().now();
  last_notification_ = std::max(last_notification_, now + delay() + conditions_.notifications.late);
  process_.after(last_notification_ - now, [self = shared_from_this(), channel, variable, value,
                                            connection = connection_] {
    if (self->still(connection)) {
      self->events_.on_notification({self->controller_.name(), channel}, variable, value);
    }
  });
}

void AdsLink::stop_notifying(std::uint16_t channel) {
  subscriptions_.erase(channel);
  controller_.channel(channel).watchers.erase(this);
}

void AdsLink::stop_notifying() {
  for (const auto& [channel, subscription] : std::exchange(subscriptions_, {})) {
    controller_.channel(channel).watchers.erase(this);
  }
}

}  // namespace millrace::tests::simulation
