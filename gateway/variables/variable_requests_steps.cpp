// The requests to the controller, and their results.

#include <fmt/format.h>

#include "cnc/ads/error.hpp"
#include "gateway/text.hpp"
#include "gateway/variables/variable_cache.hpp"
#include "gateway/variables/variable_requests.hpp"

namespace millrace::gateway::variables {

using fabric::VariableReply;
using fabric::VariableRequest;

/// The variables of one request: unknown names, or values of one port.
struct VariableRequests::Batch {
  static constexpr std::size_t most_resolved = 32;
  std::size_t at_once = 0;
  data::Resolve resolve{};
  Entries resolved{};
  data::Read read{};
  Entries to_read{};
  std::size_t bytes = 0;
};

void VariableRequests::add_to_batch(Batch& batch, const OpenRequest& open) {
  for (std::size_t i = 0; i < open.variables.size(); ++i) {
    const std::shared_ptr<VariableCacheEntry>& variable = open.variables[i];
    VariableCacheEntry& entry = *variable;
    if (entry.at >= open.since || entry.in_batch) {
      continue;
    }
    if (!entry.reading) {
      if (batch.resolved.size() < Batch::most_resolved &&
          (batch.resolved.empty() || batch.resolve.channel == open.request.key.channel)) {
        entry.in_batch = true;
        batch.resolve.channel = open.request.key.channel;
        batch.resolve.names.push_back(open.request.names[i]);
        batch.resolved.push_back(variable);
      }
      continue;
    }
    const bool first = batch.to_read.empty();
    if (batch.to_read.size() < batch.at_once &&
        (first || (entry.reading->port == batch.read.readings.front().port &&
                   batch.bytes + entry.reading->length <= data::Sampler::most_bytes))) {
      entry.in_batch = true;
      batch.bytes += entry.reading->length;
      batch.read.readings.push_back(*entry.reading);
      batch.to_read.push_back(variable);
    }
  }
}

/// A request that is a step by itself.
std::optional<Step> VariableRequests::turn_of(std::uint64_t number, const OpenRequest& open) {
  pending_ = number;
  if (open.phase == Phase::listing) {
    return ListPage{open.request.key.channel, open.request.names.front(), open.request.first};
  }
  return WriteOne{open.request.key.channel, open.request.names[open.written],
                  open.values[open.written]};
}

std::optional<Step> VariableRequests::start(Batch batch) {
  // By turns, so that requests for missing variables do not delay the others.
  const bool resolve = !batch.resolved.empty() && (batch.to_read.empty() || !resolved_last_);
  resolved_last_ = resolve;
  for (const Entries* const both : {&batch.resolved, &batch.to_read}) {
    for (const std::shared_ptr<VariableCacheEntry>& entry : *both) {
      entry->in_batch = false;
    }
  }
  Entries& entries = resolve ? batch.resolved : batch.to_read;
  if (entries.empty()) {
    return std::nullopt;
  }
  pending_ = std::move(entries);
  return resolve ? Step(std::move(batch.resolve)) : Step(std::move(batch.read));
}

std::optional<Step> VariableRequests::next(Moment now) {
  if (pending() || down_reason_ || requests_.empty() ||
      rate_limit_.time_of_one(now.steady) > now.steady) {
    return std::nullopt;
  }
  Batch all{.at_once = at_once_};
  for (const auto& [number, open] : requests_) {
    const bool of_its_own = open.phase == Phase::writing || open.phase == Phase::listing;
    if (of_its_own) {
      if (all.resolved.empty() && all.to_read.empty()) {
        return turn_of(number, open);
      }
      break;
    }
    add_to_batch(all, open);
    if (open.phase != Phase::reading) {
      // The steps after a write wait for it.
      break;
    }
  }
  return start(std::move(all));
}

void VariableRequests::on_resolved(const std::vector<Found>& found, std::uint64_t requests,
                                   Moment now) {
  const Entries entries = end_step(requests);
  for (std::size_t i = 0; i < entries.size() && i < found.size(); ++i) {
    VariableCache::on_resolved(*entries[i], found[i], now);
  }
  complete(now);
}

void VariableRequests::on_read(const std::vector<Answered>& answers, std::uint64_t requests,
                               bool sums, Moment now) {
  at_once_ = sums ? data::Sampler::most_together : 1;
  const Entries entries = end_step(requests);
  for (std::size_t i = 0; i < entries.size() && i < answers.size(); ++i) {
    VariableCache::on_read(*entries[i], answers[i], now);
    if (!answers[i] && cnc::ads::is_overload(answers[i].error())) {
      rate_limit_.empty();
    }
  }
  complete(now);
}

void VariableRequests::on_written(const cnc::ads::Result<void>& outcome, std::uint64_t requests,
                                  Moment now) {
  const auto found = end_request_step(requests);
  // Also those of an element, and of all of an array.
  cache_.forget_values();
  if (found == requests_.end()) {
    return;
  }
  OpenRequest& open = found->second;
  const std::string name = printable(open.request.names[open.written]);
  if (outcome) {
    replies_.report_write(open.request, true,
                          fmt::format("{} was {}, is written as {}", name,
                                      text_of(open.before[open.written].elements),
                                      text_of(open.request.values[open.written])),
                          now);
    if (++open.written == open.request.names.size()) {
      open.phase = Phase::after;
      open.since = now.steady;
    }
    complete(now);
    return;
  }
  const bool unknown = cnc::ads::leaves_outcome_unknown(outcome.error());
  std::string why = fmt::format("{}: {}",
                                unknown ? fmt::format("{} may or may not be written; read it", name)
                                        : fmt::format("{} is not written", name),
                                cnc::ads::describe(outcome.error()));
  replies_.report_write(open.request, false, why, now);
  if (open.written > 0) {
    why += fmt::format("; the {} before it are", open.written);
  }
  auto results = results_of(open);
  results[open.written].error = ads_number(outcome.error());
  replies_.refuse(open.request, why, now, std::move(results));
  requests_.erase(found);
  complete(now);
}

void VariableRequests::on_listed(const cnc::ads::Result<Page>& page, std::uint64_t requests,
                                 Moment now) {
  const auto found = end_request_step(requests);
  if (found == requests_.end()) {
    return;
  }
  const VariableRequest& request = found->second.request;
  if (page) {
    VariableReply reply{.done = true, .total = page->total};
    for (const cnc::variables::Description& variable : page->variables) {
      reply.results.push_back({.value = {.name = variable.name,
                                         .type = static_cast<fabric::ValueType>(variable.type),
                                         .is_array = !variable.dimensions.empty()},
                               .writable = variable.access == cnc::variables::Access::read_write,
                               .size = variable.size,
                               .dimensions = variable.dimensions});
    }
    replies_.answer(request, std::move(reply), now);
  } else {
    replies_.refuse(
        request,
        fmt::format("cannot list {}: {}", request.names.front(), cnc::ads::describe(page.error())),
        now);
  }
  requests_.erase(found);
  complete(now);
}

}  // namespace millrace::gateway::variables
