#include "gateway/machines/subscriptions.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"

namespace millrace::gateway::machines {

SubscriptionActions Subscriptions::serve(const std::vector<std::uint16_t>& channels) {
  SubscriptionActions actions;
  for (auto it = channels_.begin(); it != channels_.end();) {
    auto& [number, channel] = *it;
    if (std::ranges::find(channels, number) != channels.end()) {
      ++it;
      continue;
    }
    reset(number, channel, Step::idle, actions);
    it = channels_.erase(it);
  }
  for (const std::uint16_t channel : channels) {
    channels_.try_emplace(channel);
  }
  ask(actions);
  describe(actions);
  return actions;
}

void Subscriptions::link_down() {
  channels_.clear();
  given_up_.clear();
  times_late_ = 0;
  missed_.clear();
  again_.reset();
  pause_ = shortest_pause;
}

SubscriptionActions Subscriptions::set_mode(SubscriptionMode mode) {
  SubscriptionActions actions;
  if (mode == mode_) {
    return actions;
  }
  mode_ = mode;
  given_up_.clear();
  times_late_ = 0;
  missed_.clear();
  again_.reset();
  pause_ = shortest_pause;
  for (auto& [number, channel] : channels_) {
    if (mode == SubscriptionMode::poll || channel.subscription.step == Step::refused) {
      reset(number, channel, Step::idle, actions);
    }
  }
  ask(actions);
  describe(actions);
  return actions;
}

/// Requests all subscriptions that are missing.
void Subscriptions::ask(SubscriptionActions& actions) {
  if (mode_ == SubscriptionMode::poll || !given_up_.empty()) {
    return;
  }
  for (auto& [number, channel] : channels_) {
    if (channel.subscription.step == Step::idle) {
      channel.subscription.step = Step::asked;
      actions.subscribe.push_back(number);
    }
  }
}

SubscriptionActions Subscriptions::on_subscribed(const std::vector<SubscribeOutcome>& outcomes,
                                                 SteadyTime now) {
  SubscriptionActions actions;
  for (const SubscribeOutcome& outcome : outcomes) {
    const auto found = channels_.find(outcome.channel);
    if (found == channels_.end() || found->second.subscription.step != Step::asked) {
      continue;  // the result of an earlier request is obsolete
    }
    Subscription& subscription = found->second.subscription;
    if (outcome.refusal.empty()) {
      subscription.step = Step::granted;
      subscription.refusal.clear();
      // The first value may have come before this answer.
      trust(outcome.channel, found->second, actions);
    } else {
      subscription.step = Step::idle;  // there is nothing to unsubscribe from
      // Values notified until now say nothing about the next subscription.
      reset(outcome.channel, found->second, outcome.undecided ? Step::idle : Step::refused,
            actions);
      subscription.refusal = outcome.refusal;
      if (outcome.undecided || mode_ == SubscriptionMode::notify) {
        try_again(now);
      }
    }
  }
  describe(actions);
  return actions;
}

SubscriptionActions Subscriptions::on_notification(std::uint16_t channel, Variable variable,
                                                   std::optional<std::uint32_t> value,
                                                   SteadyTime now) {
  SubscriptionActions actions;
  const auto found = channels_.find(channel);
  if (found == channels_.end() || (found->second.subscription.step != Step::granted &&
                                   found->second.subscription.step != Step::asked)) {
    return actions;
  }
  auto& [read_state, read_response, trusted, subscription] = found->second;
  if (!value) {
    // After a restart or an online change of the controller, its handles are invalid.
    reset(channel, found->second, Step::idle, actions);
    subscription.refusal = "the controller has dropped its handle";
    actions.changed.emplace_back(channel, Variable::request_state);
    try_again(now);
    describe(actions);
    return actions;
  }
  if (variable == Variable::response_state) {
    if (read_response != value) {
      actions.changed.emplace_back(channel, variable);
    }
    return actions;
  }
  // The same value again: a change in between was not notified.
  if (subscription.notified == value && subscription.other != Other::none &&
      missed(channel, actions, now)) {
    return actions;
  }
  if (subscription.zero_shown_at && value == 0U) {
    times_late_ = now - *subscription.zero_shown_at > late ? times_late_ + 1 : 0;
    subscription.zero_shown_at.reset();
  } else if (read_state == value) {
    // The NC program was faster than the controller's cycle: our write will never be notified.
    subscription.zero_shown_at.reset();
  }
  subscription.notified = value;
  subscription.notified_since_read = true;
  subscription.other = Other::none;
  subscription.unnotified.reset();
  if (times_late_ >= most_late) {
    give_up(fmt::format("its notifications come more than {} ms late", late.count()), actions, now);
    return actions;
  }
  if (read_state != subscription.notified) {
    actions.changed.emplace_back(channel, variable);
  }
  trust(channel, found->second, actions);
  return actions;
}

void Subscriptions::read_started(std::uint16_t channel) {
  if (const auto found = channels_.find(channel); found != channels_.end()) {
    found->second.subscription.notified_since_read = false;
  }
}

SubscriptionActions Subscriptions::on_read(std::uint16_t channel, const ServiceSnapshot& snapshot,
                                           SteadyTime now) {
  SubscriptionActions actions;
  const auto found = channels_.find(channel);
  if (found == channels_.end()) {
    return actions;
  }
  if (snapshot.has(Variable::response_state)) {
    found->second.response_state = snapshot.response_state;
  }
  if (snapshot.has(Variable::request_state)) {
    see(channel, snapshot.request_state, actions, now);
  }
  return actions;
}

void Subscriptions::on_cleared(std::uint16_t channel) {
  if (const auto found = channels_.find(channel); found != channels_.end()) {
    found->second.subscription.cleared = true;
  }
}

void Subscriptions::see(std::uint16_t channel, std::uint32_t state, SubscriptionActions& actions,
                        SteadyTime now) {
  Channel& read = channels_.at(channel);
  Subscription& subscription = read.subscription;
  const bool same = std::exchange(read.request_state, state) == state;
  const bool by_us = state == 0 && std::exchange(subscription.cleared, false);
  if (subscription.step != Step::granted) {
    return;
  }
  if (by_us && subscription.notified != state && !subscription.zero_shown_at) {
    subscription.zero_shown_at = now;
  }
  if (subscription.notified == state) {
    subscription.unnotified.reset();
    if (subscription.other == Other::found_by_read) {
      subscription.other = Other::none;
      if (missed(channel, actions, now)) {
        return;
      }
    }
  } else if (by_us || !subscription.notified_since_read) {
    if (subscription.other == Other::none) {
      subscription.other = subscription.notified && !by_us ? Other::found_by_read : Other::seen;
    }
    if (!subscription.unnotified || (!same && subscription.notified)) {
      subscription.unnotified = Unnotified{.since = now};
    }
    ++subscription.unnotified->reads;
    if (now - subscription.unnotified->since > lost &&
        subscription.unnotified->reads >= lost_reads) {
      give_up(subscription.notified
                  ? fmt::format("it sent no notification of a change of {} in channel {}",
                                cnc::variables::name_of(Variable::request_state), channel)
                  : fmt::format("it accepts subscriptions and sends no notification, not "
                                "even the first value of channel {}",
                                channel),
              actions, now);
      return;
    }
  }
  trust(channel, read, actions);
}

bool Subscriptions::missed(std::uint16_t channel, SubscriptionActions& actions, SteadyTime now) {
  missed_.push_back(now);
  while (now - missed_.front() > missed_within) {
    missed_.pop_front();
  }
  if (missed_.size() < most_missed) {
    return false;
  }
  give_up(fmt::format("it does not send a notification for each change of {} in channel {}",
                      cnc::variables::name_of(Variable::request_state), channel),
          actions, now);
  return true;
}

void Subscriptions::trust(std::uint16_t number, Channel& channel, SubscriptionActions& actions) {
  const Subscription& subscription = channel.subscription;
  const bool trusted = subscription.step == Step::granted && subscription.notified &&
                       subscription.notified == channel.request_state;
  if (std::exchange(channel.trusted, trusted) != trusted) {
    actions.trusted.emplace_back(number, trusted);
  }
}

void Subscriptions::reset(std::uint16_t number, Channel& channel, Step step,
                          SubscriptionActions& actions) {
  const Step before = std::exchange(channel.subscription, {.step = step}).step;
  if (before == Step::granted || before == Step::asked) {
    actions.unsubscribe.push_back(number);
  }
  trust(number, channel, actions);
}

void Subscriptions::give_up(const fabric::Message& reason, SubscriptionActions& actions,
                            SteadyTime now) {
  given_up_ = reason;
  again_.reset();
  missed_.clear();
  times_late_ = 0;
  for (auto& [number, channel] : channels_) {
    reset(number, channel, Step::idle, actions);
  }
  if (mode_ == SubscriptionMode::notify) {
    try_again(now);
  }
  describe(actions);
}

/// Again sooner at first, once a minute in the end.
void Subscriptions::try_again(SteadyTime now) {
  if (!again_) {
    again_ = now + pause_;
    pause_ = std::min(2 * pause_, longest_pause);
  }
}

SubscriptionActions Subscriptions::on_time(SteadyTime now) {
  SubscriptionActions actions;
  if (!again_ || now < *again_) {
    return actions;
  }
  again_.reset();
  if (mode_ == SubscriptionMode::notify) {
    given_up_.clear();
  }
  for (auto& [number, channel] : channels_) {
    if (channel.subscription.step == Step::refused && mode_ == SubscriptionMode::notify) {
      reset(number, channel, Step::idle, actions);
    }
  }
  ask(actions);
  describe(actions);
  return actions;
}

Subscriptions::Status Subscriptions::status() const {
  using enum fabric::WatchMode;
  if (channels_.empty()) {
    return {};
  }
  if (mode_ == SubscriptionMode::poll) {
    return {polled, base::messages::polled_as_configured()};
  }
  if (!given_up_.empty()) {
    return {polled, base::messages::polled(given_up_)};
  }
  fabric::Message refusal;
  std::string which;
  std::size_t refused = 0;
  bool granted = false;
  for (const auto& [number, channel] : channels_) {
    const Subscription& subscription = channel.subscription;
    granted = granted || subscription.step == Step::granted;
    if (!subscription.refusal.empty() && subscription.step != Step::granted) {
      which += fmt::format("{}{}", refused == 0 ? "" : ", ", number);
      refusal = refused == 0 ? subscription.refusal : refusal;
      ++refused;
    }
  }
  if (refused == channels_.size()) {
    return {polled, base::messages::polled(refusal)};
  }
  if (refused > 0) {
    return {partly_pushed, base::messages::partly_pushed(which, refusal)};
  }
  return {granted ? pushed : polled, {}};
}

/// Not for each read: it goes through all channels.
void Subscriptions::describe(SubscriptionActions& actions) {
  actions.status = true;
  const auto [mode, text] = status();
  const bool pushed = mode == fabric::WatchMode::pushed;
  const std::string line = pushed ? "pushed: the controller sends "
                                    "notifications; polling is only a safeguard"
                                  : text;
  if (line == logged_ || line.empty()) {
    return;
  }
  const bool news = !logged_.empty() || line != base::messages::polled_as_configured.sentence;
  logged_ = line;
  if (news) {
    actions.log.emplace_back(
        pushed || mode_ != SubscriptionMode::notify ? Level::info : Level::warn, line);
  }
}

}  // namespace millrace::gateway::machines
