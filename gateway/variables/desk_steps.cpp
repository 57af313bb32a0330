// What is asked of the controller, and what comes of it.
#include <algorithm>

#include <fmt/format.h>

#include "cnc/ads/error.hpp"
#include "gateway/variables/desk.hpp"
#include "gateway/variables/words.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway::variables {

using fabric::VariableReply;
using fabric::VariableRequest;

/// What is asked together: names that are not known yet, or values of one port.
struct Desk::Pick {
  static constexpr std::size_t most_looked_up = 32;
  std::uint64_t step = 0;
  std::size_t at_once = 0;
  data::LookUp look_up{};
  std::vector<Known*> looked_up{};
  data::Read read{};
  std::vector<Known*> to_read{};
  std::size_t bytes = 0;
};

void Desk::pick(Pick& pick, const Open& open) {
  for (std::size_t i = 0; i < open.variables.size(); ++i) {
    Known& one = *open.variables[i];
    if (one.at >= open.since || one.step == pick.step) {
      continue;
    }
    if (!one.reading) {
      if (pick.looked_up.size() < Pick::most_looked_up &&
          (pick.looked_up.empty() || pick.look_up.channel == open.request.key.channel)) {
        one.step = pick.step;
        pick.look_up.channel = open.request.key.channel;
        pick.look_up.names.push_back(open.request.names[i]);
        pick.looked_up.push_back(&one);
      }
      continue;
    }
    const bool first = pick.to_read.empty();
    if (pick.to_read.size() < pick.at_once &&
        (first || (one.reading->port == pick.read.readings.front().port &&
                   pick.bytes + one.reading->length <= data::Sampler::most_bytes))) {
      one.step = pick.step;
      pick.bytes += one.reading->length;
      pick.read.readings.push_back(*one.reading);
      pick.to_read.push_back(&one);
    }
  }
}

/// Of a request that is a step of its own.
std::optional<Step> Desk::turn_of(std::uint64_t number, const Open& open) {
  busy_ = true;
  request_under_way_ = number;
  if (open.phase == Phase::listing) {
    return ListPage{open.request.key.channel, open.request.names.front(), open.request.first};
  }
  return WriteOne{open.request.key.channel, open.request.names[open.written],
                  open.values[open.written]};
}

std::optional<Step> Desk::start(Pick pick) {
  // By turns, so that who asks for what is not there does not keep the others waiting.
  const bool look_up = !pick.looked_up.empty() && (pick.to_read.empty() || !looked_up_last_);
  looked_up_last_ = look_up;
  under_way_ = look_up ? std::move(pick.looked_up) : std::move(pick.to_read);
  if (under_way_.empty()) {
    return std::nullopt;
  }
  busy_ = true;
  for (Known* one : under_way_) {
    ++one->users;
  }
  return look_up ? Step(std::move(pick.look_up)) : Step(std::move(pick.read));
}

std::optional<Step> Desk::next(Moment now) {
  if (busy_ || !up_ || opens_.empty() || budget_.time_of_one(now.steady) > now.steady) {
    return std::nullopt;
  }
  Pick all{.step = ++step_, .at_once = at_once_};
  for (const auto& [number, open] : opens_) {
    const bool of_its_own = open.phase == Phase::writing || open.phase == Phase::listing;
    if (of_its_own) {
      if (all.looked_up.empty() && all.to_read.empty()) {
        return turn_of(number, open);
      }
      break;
    }
    pick(all, open);
    if (open.phase != Phase::reading) {
      // What stands behind a write comes after it.
      break;
    }
  }
  return start(std::move(all));
}

void Desk::on_looked_up(const std::vector<Found>& found, std::uint64_t requests, Moment now) {
  budget_.spend(static_cast<double>(requests));
  for (std::size_t i = 0; i < under_way_.size() && i < found.size(); ++i) {
    KnownVariables::on_looked_up(*under_way_[i], found[i], now);
  }
  let_go_of_step();
  settle(now);
}

void Desk::on_read(const std::vector<Answered>& answers, std::uint64_t requests, bool sums,
                   Moment now) {
  budget_.spend(static_cast<double>(requests));
  at_once_ = sums ? data::Sampler::most_together : 1;
  for (std::size_t i = 0; i < under_way_.size() && i < answers.size(); ++i) {
    KnownVariables::on_read(*under_way_[i], answers[i], now);
    if (!answers[i] && cnc::ads::is_overload(answers[i].error())) {
      budget_.empty();
    }
  }
  let_go_of_step();
  settle(now);
}

void Desk::on_written(const cnc::ads::Result<void>& outcome, std::uint64_t requests, Moment now) {
  budget_.spend(static_cast<double>(requests));
  const auto found = opens_.find(request_under_way_);
  let_go_of_step();
  // Also those of an element, and of all of an array.
  known_.forget_values();
  if (found == opens_.end()) {
    return;
  }
  Open& open = found->second;
  const std::string name = printable(open.request.names[open.written]);
  if (outcome) {
    tell_write(open.request, true,
               fmt::format("{} was {}, is written as {}", name,
                           text_of(open.before[open.written].elements),
                           text_of(open.request.values[open.written])),
               now);
    if (++open.written == open.request.names.size()) {
      open.phase = Phase::after;
      open.since = now.steady;
    }
    settle(now);
    return;
  }
  const bool unknown = cnc::ads::leaves_outcome_unknown(outcome.error());
  std::string why =
      fmt::format("{}: {}",
                  unknown ? fmt::format("nobody knows whether {} was written, so read it", name)
                          : fmt::format("{} is not written", name),
                  cnc::ads::describe(outcome.error()));
  tell_write(open.request, false, why, now);
  if (open.written > 0) {
    why += fmt::format("; the {} before it are", open.written);
  }
  auto results = results_of(open);
  results[open.written].error = ads_number(outcome.error());
  refuse(open.request, why, now, std::move(results));
  close(found);
  settle(now);
}

void Desk::on_listed(const cnc::ads::Result<Page>& page, std::uint64_t requests, Moment now) {
  budget_.spend(static_cast<double>(requests));
  const auto found = opens_.find(request_under_way_);
  let_go_of_step();
  if (found == opens_.end()) {
    return;
  }
  const VariableRequest& request = found->second.request;
  if (page) {
    VariableReply reply{.done = true, .total = page->total};
    for (const cnc::variables::Description& one : page->variables) {
      reply.results.push_back({.value = {.name = one.name,
                                         .type = static_cast<fabric::ValueType>(one.type),
                                         .is_array = !one.dimensions.empty()},
                               .writable = one.access == cnc::variables::Access::read_write,
                               .size = one.size,
                               .dimensions = one.dimensions});
    }
    answer(request, std::move(reply), now);
  } else {
    refuse(
        request,
        fmt::format("cannot list {}: {}", request.names.front(), cnc::ads::describe(page.error())),
        now);
  }
  close(found);
  settle(now);
}

}  // namespace millrace::gateway::variables
