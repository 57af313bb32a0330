#include "gateway/data/sampler.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "gateway/data/group.hpp"

namespace millrace::gateway::data {

using cnc::variables::Reading;
using fabric::Quality;

Sampler::Sampler(std::string machine, const DataSettings& settings)
    : machine_(std::move(machine)), rate_limit_(settings.requests_per_second) {
  for (const GroupSettings& group : settings.groups) {
    groups_.emplace_back(group, machine_);
  }
}

void Sampler::on_up(const std::vector<std::uint16_t>& channels, SteadyTime now) {
  for (Group& group : groups_) {
    if (!group.started() &&
        std::ranges::find(channels, group.settings().channel) != channels.end()) {
      group.start(now);
    }
  }
}

void Sampler::on_down(const fabric::Message& reason, Moment now) {
  under_way_.clear();
  at_once_ = most_together;
  for (Group& group : groups_) {
    if (!group.started()) {
      continue;
    }
    if (auto sample = group.stop(reason, now)) {
      output_.samples.push_back(std::move(*sample));
    }
  }
}

void Sampler::on_over(std::uint16_t channel, Moment now) {
  for (Group& group : groups_) {
    if (channel == 0 || group.settings().channel == channel) {
      static_cast<void>(group.stop(base::messages::other_gateway_may_publish(), now));
      group.republish();
      output_.left.push_back(
          {.key = {machine_, group.settings().channel}, .group = group.settings().name});
    }
  }
  if (channel == 0) {
    under_way_.clear();
  }
}

std::optional<Step> Sampler::next(Moment now) {
  if (!under_way_.empty()) {
    return std::nullopt;
  }
  const auto ready = next_time(now.steady);
  if (!ready || *ready > now.steady) {
    return std::nullopt;
  }
  if (auto step = resolve(now.steady)) {
    return step;
  }
  return read(now);
}

/// Those of one channel that are not known yet.
std::optional<Step> Sampler::resolve(SteadyTime now) {
  constexpr std::size_t most = 32;
  Resolve step;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    Group& group = groups_[g];
    const bool fits = step.names.empty() || step.channel == group.settings().channel;
    for (std::size_t i = 0; group.started() && fits && i < group.items().size(); ++i) {
      const Item& item = group.at(i);
      if (!item.reading && item.resolve_at <= now && step.names.size() < most) {
        step.channel = group.settings().channel;
        step.names.push_back(item.value.name);
        under_way_.push_back({g, i});
      }
    }
  }
  return step.names.empty() ? std::nullopt : std::optional<Step>(std::move(step));
}

/// Those that are due, the one that has waited longest first, and with it what is at its port.
std::optional<Step> Sampler::read(Moment now) {
  std::vector<std::size_t> due;
  for (Group& group : groups_) {
    if (group.started() && !group.in_cycle() && group.due() <= now.steady) {
      group.begin_cycle();
    }
  }
  // Groups without a readable variable.
  end_cycles(now);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    Group& group = groups_[g];
    if (group.in_cycle() && !group.pending().empty()) {
      due.push_back(g);
    }
  }
  std::ranges::stable_sort(
      due, [&](std::size_t a, std::size_t b) { return groups_[a].due() < groups_[b].due(); });
  Read step;
  std::size_t bytes = 0;
  for (const std::size_t g : due) {
    Group& group = groups_[g];
    const std::set<std::size_t> pending = group.pending();
    for (const std::size_t i : pending) {
      const Reading& reading = *group.at(i).reading;
      const bool first = step.readings.empty();
      if (step.readings.size() < at_once_ &&
          (first ||
           (reading.port == step.readings.front().port && bytes + reading.length <= most_bytes))) {
        bytes += reading.length;
        step.readings.push_back(reading);
        under_way_.push_back({g, i});
        group.asked(i);
      }
    }
  }
  return step.readings.empty() ? std::nullopt : std::optional<Step>(std::move(step));
}

std::optional<SteadyTime> Sampler::next_time(SteadyTime now) {
  if (!under_way_.empty()) {
    return std::nullopt;
  }
  std::optional<SteadyTime> first;
  const auto note = [&](SteadyTime time) { first = earliest({first, time}); };
  for (Group& group : groups_) {
    if (!group.started()) {
      continue;
    }
    note(group.in_cycle() ? now : group.due());
    for (const Item& item : group.items()) {
      if (!item.reading) {
        note(item.resolve_at);
      }
    }
  }
  if (!first) {
    return std::nullopt;
  }
  const SteadyTime allowed = rate_limit_.time_of_one(now);
  short_of_budget_ = short_of_budget_ || (*first <= now && allowed > now);
  return std::max(*first, allowed);
}

void Sampler::refuse(Item& item, const fabric::Message& reason, SteadyTime again) {
  item.value.quality = Quality::refused;
  item.value.reason = reason;
  item.reading.reset();
  item.resolve_at = again;
}

void Sampler::on_resolved(const std::vector<Resolved>& known, std::uint64_t requests, Moment now) {
  const std::vector<Place> places = std::exchange(under_way_, {});
  rate_limit_.spend(static_cast<double>(requests));
  for (std::size_t i = 0; i < places.size() && i < known.size(); ++i) {
    if (!groups_[places[i].group].started()) {
      continue;
    }
    Item& sampled = item(places[i]);
    if (known[i]) {
      sampled.reading = *known[i];
      sampled.value.type = type_of(*known[i]);
      sampled.value.is_array = known[i]->is_array;
      sampled.value.quality = Quality::stale;
      sampled.value.reason = base::messages::value_not_read_yet();
    } else if (is_refusal(known[i].error().code)) {
      refuse(sampled, known[i].error().reason, now.steady + retry_refused);
    } else {
      sampled.value.quality = Quality::stale;
      sampled.value.reason = known[i].error().reason;
      sampled.resolve_at = now.steady + retry_silent;
    }
  }
  report_refused(places);
}

void Sampler::take_answer(Place place, const Answer& answer, Moment now) {
  Item& sampled = item(place);
  if (answer) {
    auto elements = elements_of(*sampled.reading, *answer);
    if (!elements) {
      refuse(sampled, elements.error(), now.steady + retry_refused);
      return;
    }
    sampled.value.elements = std::move(*elements);
    sampled.value.quality = Quality::good;
    sampled.value.at = now.wall;
    sampled.value.reason.clear();
    return;
  }
  const cnc::ads::ErrorCode code = answer.error();
  if (is_refusal(code)) {
    if (sampled.value.quality != Quality::good) {
      refuse(sampled, cnc::ads::describe(code), now.steady + retry_refused);
      return;
    }
    // A valid handle may have changed by now.
    sampled.reading.reset();
    sampled.resolve_at = now.steady;
  }
  if (is_overload(code)) {
    rate_limit_.empty();
  }
  sampled.value.quality = Quality::stale;
  sampled.value.reason = cnc::ads::describe(code);
}

void Sampler::on_read(const std::vector<Answer>& answers, std::uint64_t requests, bool sums,
                      Moment now) {
  const std::vector<Place> places = std::exchange(under_way_, {});
  rate_limit_.spend(static_cast<double>(requests));
  at_once_ = sums ? most_together : 1;
  for (std::size_t i = 0; i < places.size() && i < answers.size(); ++i) {
    Group& group = groups_[places[i].group];
    if (group.started() && group.in_cycle()) {
      group.answered();
      take_answer(places[i], answers[i], now);
    }
  }
  report_refused(places);
  end_cycles(now);
}

void Sampler::end_cycles(Moment now) {
  for (Group& group : groups_) {
    if (!group.complete()) {
      continue;
    }
    auto sample = group.end_cycle(now);
    if (group.take_period_change()) {
      report_period(group);
      short_of_budget_ = false;
    }
    if (sample) {
      output_.samples.push_back(std::move(*sample));
    }
  }
}

/// Once for each reason, in one line for all that have it.
void Sampler::report_refused(const std::vector<Place>& places) {
  std::map<std::pair<std::size_t, std::string>, std::string> by_reason;
  for (const Place place : places) {
    Item& sampled = item(place);
    if (sampled.value.quality == Quality::refused && sampled.logged != sampled.value.reason) {
      sampled.logged = sampled.value.reason;
      std::string& names = by_reason[{place.group, sampled.value.reason}];
      names += (names.empty() ? "" : ", ") + sampled.value.name;
    }
  }
  for (const auto& [key, names] : by_reason) {
    output_.lines.push_back(
        {Level::warn,
         fmt::format("{}: {} cannot be read: {}; tried again every {} s", where(groups_[key.first]),
                     names, key.second, retry_refused.count())});
  }
}

void Sampler::report_period(const Group& group) {
  const auto wanted = group.settings().period.count();
  if (!group.cycle_time().slow()) {
    output_.lines.push_back(
        {Level::info, fmt::format("{}: sampled every {} ms again", where(group), wanted)});
    return;
  }
  const auto ms =
      std::chrono::duration_cast<std::chrono::milliseconds>(group.cycle_time().period()).count();
  output_.lines.push_back(
      {Level::warn,
       fmt::format("{}: sampled every {} ms, not every {} ms: {}", where(group), ms, wanted,
                   short_of_budget_
                       ? fmt::format("the budget of {} requests a second is used up",
                                     rate_limit_.per_second())
                       : "the controller responds too slowly, or calls had priority")});
}

std::string Sampler::where(const Group& group) const {
  const GroupSettings& settings = group.settings();
  // A group of a configuration has no slash in its name: what is sampled for something else has.
  const bool hidden = settings.name.starts_with('/');
  return fmt::format("{}/{}: {}{}", machine_, settings.channel, hidden ? "" : "data ",
                     hidden ? settings.name.substr(1) : settings.name);
}

}  // namespace millrace::gateway::data
