#include "tests/simulation/exhaustive/explorer.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <tuple>
#include <utility>

namespace millrace::tests::simulation {

void Explorer::begin() {
  ++runs_;
  depth_ = 0;
  known_ = false;
  started_ = false;
  early_ = 0;
  now_ = {};
  described_.fill({});
  changed_ = 0;
  current_ = 0;
  planned_ = 0;
  // Nothing is new before the point where this run differs from the one before.
  repeating_ = !path_.empty() && !path_.back().found.empty();
}

bool Explorer::next() {
  if (bounds_.draw) {
    return runs_ < bounds_.most_runs;
  }
  while (!path_.empty() && path_.back().taken + 1 == path_.back().of) {
    path_.pop_back();
  }
  if (path_.empty()) {
    return false;
  }
  ++path_.back().taken;
  return runs_ < bounds_.most_runs;
}

void Explorer::repeat(const std::vector<std::size_t>& choices) {
  path_.clear();
  for (const std::size_t taken : choices) {
    path_.push_back({.taken = taken, .of = taken + 1});
  }
}

std::vector<std::size_t> Explorer::choices() const {
  std::vector<std::size_t> taken;
  for (const Choice& choice : path_) {
    taken.push_back(choice.taken);
  }
  return taken;
}

std::vector<std::size_t> Explorer::candidates(const std::vector<NcEvent>& waiting) const {
  std::vector<std::size_t> found;
  std::optional<Time> first_timer;
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    const NcEvent& event = waiting[i];
    if (event.timer) {
      first_timer = std::min(first_timer.value_or(event.at), event.at);
      continue;
    }
    const bool waits = event.lane != 0 && std::ranges::any_of(waiting, [&](const NcEvent& other) {
                         return other.lane == event.lane && other.parties == event.parties &&
                                other.number < event.number;
                       });
    if (!waits) {
      found.push_back(i);
    }
  }
  if (!first_timer || (!found.empty() && early_ == bounds_.early_timers)) {
    return found;
  }
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    if (waiting[i].timer && waiting[i].at <= *first_timer + bounds_.together) {
      found.push_back(i);
    }
  }
  return found;
}

Meaning Explorer::cause_of(const NcEvent& event) const {
  const auto known = now_.causes.find(event.number);
  assert(known != now_.causes.end());
  return known->second;
}

Meaning Explorer::state(const std::vector<NcEvent>& waiting) const {
  Meaning on_its_way = 0;
  for (const NcEvent& event : waiting) {
    on_its_way += meaning_of(cause_of(event), event.parties, event.lane, event.timer);
  }
  Meaning all = meaning_of(early_, now_.judged, on_its_way);
  for (const Meaning party : now_.parties) {
    all = meaning_of(all, party);
  }
  return all;
}

/// Runs that come to the same state may plan events in different orders, but for the same causes.
void Explorer::sort(std::vector<std::size_t>& found, const std::vector<NcEvent>& waiting) const {
  std::ranges::sort(found, {}, [&](std::size_t i) {
    return std::tuple(waiting[i].timer, cause_of(waiting[i]), waiting[i].number);
  });
}

std::optional<std::size_t> Explorer::pick(std::vector<std::size_t> found,
                                          const std::vector<NcEvent>& waiting) {
  if (repeating_) {
    const Choice& choice = path_[depth_++];
    if (depth_ == path_.size()) {
      now_ = choice.before;
      changed_ = 0;
      repeating_ = false;
    }
    return choice.found[choice.taken];
  }
  sort(found, waiting);
  if (bounds_.draw) {
    states_.insert(state(waiting));
    on_new_choice();
    return found[random_.below(found.size())];
  }
  if (depth_ == path_.size()) {
    if (!states_.insert(state(waiting)).second) {
      known_ = true;
      return std::nullopt;
    }
    on_new_choice();
    std::unordered_map<std::uint64_t, Meaning> causes;
    for (const NcEvent& event : waiting) {
      causes.emplace(event.number, cause_of(event));
    }
    now_.causes = std::move(causes);
    path_.push_back({.taken = 0, .of = found.size(), .found = found, .before = now_});
  }
  return found[path_[depth_++].taken];
}

std::optional<std::size_t> Explorer::choose(const std::vector<NcEvent>& waiting, Time) {
  if (!started_) {
    const auto first = std::ranges::min_element(
        waiting, {}, [](const NcEvent& event) { return std::pair(event.at, event.number); });
    return static_cast<std::size_t>(first - waiting.begin());
  }
  auto found = candidates(waiting);
  if (found.empty()) {
    return std::nullopt;
  }
  const bool any_without_timer =
      std::ranges::any_of(found, [&](std::size_t i) { return !waiting[i].timer; });
  const auto chosen =
      found.size() == 1 ? std::optional(found.front()) : pick(std::move(found), waiting);
  if (chosen) {
    early_ += waiting[*chosen].timer && any_without_timer ? 1U : 0U;
  }
  return chosen;
}

void Explorer::happens(const NcEvent& happening) {
  if (repeating_) {
    return;
  }
  current_ = cause_of(happening);
  planned_ = 0;
  for (std::uint64_t left = happening.parties | happening.reads; left != 0; left &= left - 1) {
    current_ =
        meaning_of(current_, now_.parties.at(static_cast<std::size_t>(std::countr_zero(left))));
  }
  touches(happening.parties);
}

void Explorer::touches(std::uint64_t parties) {
  if (repeating_) {
    return;
  }
  changed_ |= parties;
  for (; parties != 0; parties &= parties - 1) {
    const auto party = static_cast<std::size_t>(std::countr_zero(parties));
    now_.parties.at(party) = meaning_of(current_, now_.parties.at(party), party);
  }
}

void Explorer::becomes(std::uint64_t parties, Meaning meaning) {
  if (repeating_) {
    return;
  }
  changed_ |= parties;
  for (; parties != 0; parties &= parties - 1) {
    now_.parties.at(static_cast<std::size_t>(std::countr_zero(parties))) = meaning;
  }
  current_ = meaning_of(current_, meaning);
}

void Explorer::happened() {
  if (repeating_) {
    return;
  }
  for (; changed_ != 0; changed_ &= changed_ - 1) {
    const auto party = static_cast<std::size_t>(std::countr_zero(changed_));
    if (described_.at(party)) {
      now_.parties.at(party) = described_.at(party)();
    }
  }
}

void Explorer::planned(const NcEvent& happening, std::optional<Meaning> means) {
  if (!repeating_) {
    now_.causes[happening.number] = means ? *means : meaning_of(current_, ++planned_);
  }
}

}  // namespace millrace::tests::simulation
