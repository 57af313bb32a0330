#include "tests/simulation/exhaustive/explorer.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "tests/simulation/time/random.hpp"

namespace millrace::tests::simulation {

namespace {

std::uint64_t mix(std::uint64_t a, std::uint64_t b) {
  return Random(a ^ Random(b).next()).next();
}

}  // namespace

void Explorer::begin() {
  ++runs_;
  depth_ = 0;
  known_ = false;
  started_ = false;
  early_ = 0;
  parties_.fill(0);
  current_ = 0;
  planned_ = 0;
}

bool Explorer::next() {
  while (!path_.empty() && path_.back().taken + 1 == path_.back().of) {
    path_.pop_back();
  }
  if (path_.empty()) {
    return false;
  }
  ++path_.back().taken;
  return runs_ < bounds_.most_runs;
}

void Explorer::repeat(std::vector<std::size_t> choices) {
  path_.clear();
  for (const std::size_t taken : choices) {
    path_.push_back({taken, taken + 1});
  }
}

std::vector<std::size_t> Explorer::choices() const {
  std::vector<std::size_t> taken;
  for (const Choice& choice : path_) {
    taken.push_back(choice.taken);
  }
  return taken;
}

std::vector<std::size_t> Explorer::candidates(const std::vector<Happening>& waiting) const {
  std::vector<std::size_t> found;
  std::optional<Time> first_timer;
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    const Happening& one = waiting[i];
    if (one.timer) {
      first_timer = std::min(first_timer.value_or(one.at), one.at);
      continue;
    }
    const bool waits = one.lane != 0 && std::ranges::any_of(waiting, [&](const Happening& other) {
                         return other.lane == one.lane && other.parties == one.parties &&
                                other.number < one.number;
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

std::uint64_t Explorer::state() const {
  std::uint64_t all = early_;
  for (const std::uint64_t party : parties_) {
    if (party != 0) {
      all = mix(all, party);
    }
  }
  return all;
}

std::optional<std::size_t> Explorer::choose(const std::vector<Happening>& waiting, Time) {
  if (!started_) {
    const auto first = std::ranges::min_element(
        waiting, {}, [](const Happening& one) { return std::pair(one.at, one.number); });
    return static_cast<std::size_t>(first - waiting.begin());
  }
  auto found = candidates(waiting);
  // The order in which they were planned differs between runs; what brought them about does not.
  std::ranges::sort(found, {}, [&](std::size_t i) {
    return std::tuple(waiting[i].timer, waiting[i].cause, waiting[i].number);
  });
  if (found.empty()) {
    return std::nullopt;
  }
  std::size_t chosen = 0;
  if (found.size() > 1) {
    if (depth_ == path_.size()) {
      if (!states_.insert(state()).second) {
        known_ = true;
        return std::nullopt;
      }
      path_.push_back({0, found.size()});
    }
    path_[depth_].of = std::max(path_[depth_].of, found.size());
    chosen = path_[depth_].taken;
    ++depth_;
  }
  const Happening& one = waiting[found[chosen]];
  const bool others = std::ranges::any_of(found, [&](std::size_t i) { return !waiting[i].timer; });
  early_ += one.timer && others ? 1 : 0;
  return found[chosen];
}

void Explorer::happens(const Happening& happening) {
  current_ = happening.cause;
  planned_ = 0;
  for (std::uint64_t left = happening.parties | happening.reads; left != 0; left &= left - 1) {
    current_ = mix(current_, parties_.at(static_cast<std::size_t>(std::countr_zero(left))));
  }
  touches(happening.parties);
}

void Explorer::touches(std::uint64_t parties) {
  for (; parties != 0; parties &= parties - 1) {
    const auto party = static_cast<std::size_t>(std::countr_zero(parties));
    parties_.at(party) = mix(mix(current_, parties_.at(party)), party);
  }
}

void Explorer::becomes(std::uint64_t parties, Meaning meaning) {
  for (; parties != 0; parties &= parties - 1) {
    parties_.at(static_cast<std::size_t>(std::countr_zero(parties))) = meaning;
  }
  current_ = mix(current_, meaning);
}

Meaning Explorer::cause() {
  return mix(current_, ++planned_);
}

}  // namespace millrace::tests::simulation
