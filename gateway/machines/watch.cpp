#include "gateway/machines/watch.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace millrace::gateway::machines {

WatchActions Watch::serve(const std::vector<std::uint16_t>& channels) {
  WatchActions actions;
  for (auto it = channels_.begin(); it != channels_.end();) {
    auto& [channel, one] = *it;
    if (std::ranges::find(channels, channel) != channels.end()) {
      ++it;
      continue;
    }
    reset(channel, one, Step::idle, actions);
    it = channels_.erase(it);
  }
  for (const std::uint16_t channel : channels) {
    channels_.try_emplace(channel);
  }
  ask(actions);
  describe(actions);
  return actions;
}

void Watch::link_down() {
  channels_.clear();
  given_up_.clear();
  times_late_ = 0;
  missed_.clear();
  again_.reset();
  pause_ = shortest_pause;
}

WatchActions Watch::set_mode(WatchMode mode) {
  WatchActions actions;
  if (mode == mode_) {
    return actions;
  }
  mode_ = mode;
  given_up_.clear();
  times_late_ = 0;
  missed_.clear();
  again_.reset();
  pause_ = shortest_pause;
  for (auto& [channel, one] : channels_) {
    if (mode == WatchMode::poll || one.step == Step::refused) {
      reset(channel, one, Step::idle, actions);
    }
  }
  ask(actions);
  describe(actions);
  return actions;
}

/// For all that nobody has asked for.
void Watch::ask(WatchActions& actions) {
  if (mode_ == WatchMode::poll || !given_up_.empty()) {
    return;
  }
  for (auto& [channel, one] : channels_) {
    if (one.step == Step::idle) {
      one.step = Step::asked;
      actions.subscribe.push_back(channel);
    }
  }
}

WatchActions Watch::on_watched(const std::vector<WatchOutcome>& outcomes, SteadyTime now) {
  WatchActions actions;
  for (const WatchOutcome& outcome : outcomes) {
    const auto found = channels_.find(outcome.channel);
    if (found == channels_.end() || found->second.step != Step::asked) {
      continue;  // what came of an earlier question is of no interest any more
    }
    ChannelWatch& one = found->second;
    if (outcome.refusal.empty()) {
      one.step = Step::granted;
      one.refusal.clear();
      // The first value may have come before this answer.
      believe(outcome.channel, one, actions);
    } else {
      one.step = outcome.undecided ? Step::idle : Step::refused;
      one.refusal = outcome.refusal;
      if (outcome.undecided || mode_ == WatchMode::notify) {
        try_again(now);
      }
    }
  }
  describe(actions);
  return actions;
}

WatchActions Watch::on_told(std::uint16_t channel, Variable variable,
                            std::optional<std::uint32_t> value, SteadyTime now) {
  WatchActions actions;
  const auto found = channels_.find(channel);
  if (found == channels_.end() ||
      (found->second.step != Step::granted && found->second.step != Step::asked)) {
    return actions;
  }
  ChannelWatch& one = found->second;
  if (!value) {
    // A restart or an online change of the controller: what its handles stood for is gone.
    reset(channel, one, Step::idle, actions);
    one.refusal = "the controller has dropped its handle";
    actions.look.emplace_back(channel, Variable::request_state);
    try_again(now);
    describe(actions);
    return actions;
  }
  if (variable == Variable::response_state) {
    if (one.seen_response != value) {
      actions.look.emplace_back(channel, variable);
    }
    return actions;
  }
  // The same once more: something between was not told.
  if (one.told == value && one.other_seen && missed(channel, actions, now)) {
    return actions;
  }
  if (one.zero_shown_at && value == 0U) {
    times_late_ = now - *one.zero_shown_at > late ? times_late_ + 1 : 0;
    one.zero_shown_at.reset();
  } else if (one.seen == value) {
    // The program was faster than the controller's cycle: what we wrote will never be told.
    one.zero_shown_at.reset();
  }
  one.told = value;
  one.told_since_look = true;
  one.other_seen = false;
  one.found_by_look = false;
  one.untold_since.reset();
  one.untold_looks = 0;
  if (times_late_ >= most_late) {
    give_up(fmt::format("it tells of changes more than {} ms late", late.count()), actions, now);
    return actions;
  }
  if (one.seen != one.told) {
    actions.look.emplace_back(channel, variable);
  }
  believe(channel, one, actions);
  return actions;
}

void Watch::looking(std::uint16_t channel) {
  if (const auto found = channels_.find(channel); found != channels_.end()) {
    found->second.told_since_look = false;
  }
}

WatchActions Watch::on_looked(std::uint16_t channel, const Snapshot& snapshot, SteadyTime now) {
  WatchActions actions;
  const auto found = channels_.find(channel);
  if (found == channels_.end()) {
    return actions;
  }
  if (snapshot.has(Variable::response_state)) {
    found->second.seen_response = snapshot.response_state;
  }
  if (snapshot.has(Variable::request_state)) {
    see(channel, snapshot.request_state, actions, now);
  }
  return actions;
}

void Watch::on_cleared(std::uint16_t channel) {
  if (const auto found = channels_.find(channel); found != channels_.end()) {
    found->second.cleared = true;
  }
}

void Watch::see(std::uint16_t channel, std::uint32_t state, WatchActions& actions, SteadyTime now) {
  ChannelWatch& one = channels_.at(channel);
  const bool same = std::exchange(one.seen, state) == state;
  const bool by_us = state == 0 && std::exchange(one.cleared, false);
  if (one.step != Step::granted) {
    return;
  }
  if (by_us && one.told != state && !one.zero_shown_at) {
    one.zero_shown_at = now;
  }
  if (one.told == state) {
    one.untold_since.reset();
    one.untold_looks = 0;
    if (one.found_by_look) {
      one.other_seen = false;
      one.found_by_look = false;
      if (missed(channel, actions, now)) {
        return;
      }
    }
  } else if (by_us || !one.told_since_look) {
    one.found_by_look = one.found_by_look || (!one.other_seen && one.told && !by_us);
    one.other_seen = true;
    if (!one.untold_since || (!same && one.told)) {
      one.untold_since = now;
      one.untold_looks = 0;
    }
    ++one.untold_looks;
    if (now - *one.untold_since > lost && one.untold_looks >= lost_looks) {
      give_up(one.told ? fmt::format("it did not tell of a change of {} in channel {}",
                                     cnc::variables::name_of(Variable::request_state), channel)
                       : fmt::format("it grants notifications and tells nothing, not even the "
                                     "first value of channel {}",
                                     channel),
              actions, now);
      return;
    }
  }
  believe(channel, one, actions);
}

bool Watch::missed(std::uint16_t channel, WatchActions& actions, SteadyTime now) {
  missed_.push_back(now);
  while (now - missed_.front() > missed_within) {
    missed_.pop_front();
  }
  if (missed_.size() < most_missed) {
    return false;
  }
  give_up(fmt::format("it does not tell of all changes of {} in channel {}",
                      cnc::variables::name_of(Variable::request_state), channel),
          actions, now);
  return true;
}

void Watch::believe(std::uint16_t channel, ChannelWatch& one, WatchActions& actions) {
  const bool believed = one.step == Step::granted && one.told && one.told == one.seen;
  if (one.believed != believed) {
    one.believed = believed;
    actions.told.emplace_back(channel, believed);
  }
}

void Watch::reset(std::uint16_t channel, ChannelWatch& one, Step step, WatchActions& actions) {
  if (one.step == Step::granted || one.step == Step::asked) {
    actions.unsubscribe.push_back(channel);
  }
  const auto seen = one.seen;
  const auto seen_response = one.seen_response;
  const bool believed = one.believed;
  one = {};
  one.step = step;
  one.seen = seen;
  one.seen_response = seen_response;
  one.believed = believed;
  believe(channel, one, actions);
}

void Watch::give_up(const std::string& reason, WatchActions& actions, SteadyTime now) {
  given_up_ = reason;
  again_.reset();
  missed_.clear();
  times_late_ = 0;
  for (auto& [channel, one] : channels_) {
    reset(channel, one, Step::idle, actions);
  }
  if (mode_ == WatchMode::notify) {
    try_again(now);
  }
  describe(actions);
}

/// Again sooner at first, once a minute in the end.
void Watch::try_again(SteadyTime now) {
  if (!again_) {
    again_ = now + pause_;
    pause_ = std::min(2 * pause_, longest_pause);
  }
}

WatchActions Watch::on_time(SteadyTime now) {
  WatchActions actions;
  if (!again_ || now < *again_) {
    return actions;
  }
  again_.reset();
  if (mode_ == WatchMode::notify) {
    given_up_.clear();
  }
  for (auto& [channel, one] : channels_) {
    if (one.step == Step::refused && mode_ == WatchMode::notify) {
      reset(channel, one, Step::idle, actions);
    }
  }
  ask(actions);
  describe(actions);
  return actions;
}

std::string Watch::words() const {
  if (channels_.empty()) {
    return {};
  }
  if (mode_ == WatchMode::poll) {
    return "polled, as configured";
  }
  if (!given_up_.empty()) {
    return "polled: " + given_up_;
  }
  std::string refusal;
  std::string which;
  std::size_t refused = 0;
  bool granted = false;
  for (const auto& [channel, one] : channels_) {
    granted = granted || one.step == Step::granted;
    if (!one.refusal.empty() && one.step != Step::granted) {
      which += fmt::format("{}{}", refused == 0 ? "" : ", ", channel);
      refusal = refused == 0 ? one.refusal : refusal;
      ++refused;
    }
  }
  if (refused == channels_.size()) {
    return "polled: " + refusal;
  }
  if (refused > 0) {
    return fmt::format("pushed, but for channel{} {}: {}", refused == 1 ? "" : "s", which, refusal);
  }
  return granted ? "pushed" : "polled";
}

/// Not for each look: it goes through all channels.
void Watch::describe(WatchActions& actions) {
  actions.status = true;
  const std::string now = words();
  if (now == said_ || now.empty() || now == "polled") {
    return;
  }
  const bool news = !said_.empty() || now != "polled, as configured";
  said_ = now;
  if (!news) {
    return;
  }
  const bool pushed = now == "pushed";
  actions.say.emplace_back(pushed || mode_ != WatchMode::notify ? Level::info : Level::warn,
                           pushed
                               ? std::string("pushed: the controller tells of changes; looks are "
                                             "for safety")
                               : now);
}

}  // namespace millrace::gateway::machines
