#include "gateway/variables/variable_requests.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/messages/format.hpp"

namespace millrace::gateway::variables {

namespace {

using fabric::VariableAction;
using fabric::VariableReply;
using fabric::VariableRequest;

std::int64_t ms(std::chrono::nanoseconds time) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(time).count();
}

std::chrono::nanoseconds patience_of(const VariableRequest& request) {
  if (request.patience <= std::chrono::nanoseconds(0)) {
    return VariableRequests::usual_patience;
  }
  return std::clamp<std::chrono::nanoseconds>(request.patience, VariableRequests::least_patience,
                                              VariableRequests::most_patience);
}

}  // namespace

VariableRequests::VariableRequests(std::string machine, VariableSettings settings)
    : machine_(std::move(machine)),
      settings_(std::move(settings)),
      rate_limit_(settings_.requests_per_second) {}

void VariableRequests::change(const VariableSettings& settings) {
  if (settings.requests_per_second != settings_.requests_per_second) {
    rate_limit_ = data::RateLimit(settings.requests_per_second);
  }
  settings_ = settings;
}

void VariableRequests::on_up(const std::vector<std::uint16_t>& channels, Moment now) {
  down_reason_.reset();
  for (const std::uint16_t channel : channels) {
    served_.try_emplace(channel, now.steady);
  }
}

void VariableRequests::on_down(const fabric::Message& reason, Moment now) {
  down_reason_ = reason;
  for (auto& [number, open] : requests_) {
    const std::string written = progress_of(open, pending_ == PendingStep(number));
    if (written.empty()) {
      replies_.refuse(open.request, fmt::format("the link to {} is down: {}", machine_, reason),
                      now);
      continue;
    }
    const std::string why =
        fmt::format("{}. The link to {} is down: {}", written, machine_, reason);
    if (open.phase == Phase::writing) {
      replies_.report_write(open.request, false, why, now);
    }
    replies_.refuse(open.request, why, now);
  }
  requests_.clear();
  end_step();
  at_once_ = data::Sampler::most_together;
  cache_.forget();
}

void VariableRequests::on_over(std::uint16_t channel, Moment now) {
  for (auto open = requests_.begin(); open != requests_.end();) {
    if (channel != 0 && open->second.request.key.channel != channel) {
      ++open;
      continue;
    }
    // A requester that only reads asks again, and hears from the new owner of the channel. So does
    // one that writes, if its write has not begun.
    if (open->second.phase == Phase::writing || open->second.phase == Phase::after) {
      replies_.refuse(
          open->second.request,
          fmt::format(
              "this gateway has stopped serving {}: the variables may be partly written; read them",
              open->second.request.key.to_string()),
          now);
    }
    open = requests_.erase(open);
  }
  served_.erase(channel);
  if (channel == 0) {
    served_.clear();
    down_reason_ = "another gateway serves it";
    end_step();
    cache_.forget();
  }
}

VariableRequests::Entries VariableRequests::end_step(std::uint64_t requests) {
  rate_limit_.spend(static_cast<double>(requests));
  PendingStep step = std::exchange(pending_, {});
  Entries* const entries = std::get_if<Entries>(&step);
  return entries == nullptr ? Entries{} : std::move(*entries);
}

VariableRequests::OpenRequests::iterator VariableRequests::end_request_step(
    std::uint64_t requests) {
  const auto* const number = std::get_if<std::uint64_t>(&pending_);
  const auto found = number != nullptr ? requests_.find(*number) : requests_.end();
  end_step(requests);
  return found;
}

void VariableRequests::on_request(const VariableRequest& request, Moment now) {
  const bool is_open = std::ranges::any_of(
      requests_, [&](const auto& open) { return open.second.request.token == request.token; });
  if (is_open || replies_.repeat(request)) {
    return;
  }
  std::string reason = wrong(request);
  if (reason.empty() && request.action == VariableAction::write) {
    reason = unwritable(request, now);
  }
  if (reason.empty()) {
    reason = down_reason_ ? fmt::format("the link to {} is down: {}", machine_, *down_reason_)
                          : too_much(request);
  }
  if (!reason.empty()) {
    if (request.action == VariableAction::write) {
      replies_.report_write(request, false, reason, now);
    }
    replies_.refuse(request, reason, now);
    return;
  }
  add(request, now);
  complete(now);
}

std::string VariableRequests::too_much(const VariableRequest& request) const {
  const auto of_one = std::ranges::count_if(requests_, [&](const auto& open) {
    return open.second.request.requester == request.requester;
  });
  if (static_cast<std::size_t>(of_one) >= most_of_one) {
    return fmt::format("{} requests of this program wait already; at most {} do", of_one,
                       most_of_one);
  }
  if (requests_.size() >= most_requests) {
    return fmt::format("{} requests wait already for {}; ask again later", requests_.size(),
                       machine_);
  }
  std::size_t names = 0;
  for (const auto& [number, open] : requests_) {
    names += open.variables.size();
  }
  if (names + request.names.size() > most_names) {
    return fmt::format("{} variables of {} are being requested already; ask again later", names,
                       machine_);
  }
  return {};
}

void VariableRequests::add(const VariableRequest& request, Moment now) {
  OpenRequest& open = requests_[++last_number_];
  open.request = request;
  open.deadline = now.steady + patience_of(request);
  // A write needs the values of the time of its request.
  open.since = now.steady;
  switch (request.action) {
    case VariableAction::list:
      open.phase = Phase::listing;
      return;
    case VariableAction::write:
      open.phase = Phase::before;
      break;
    case VariableAction::read:
      open.since = now.steady - settings_.cycle;
      break;
  }
  for (const std::string& name : request.names) {
    open.variables.push_back(cache_.of(request.key.channel, name));
  }
}

std::optional<SteadyTime> VariableRequests::next_time(SteadyTime now) {
  if (requests_.empty()) {
    return std::nullopt;
  }
  std::optional<SteadyTime> first;
  for (const auto& [number, open] : requests_) {
    if (open.phase != Phase::writing) {
      first = earliest({first, open.deadline});
    }
  }
  if (!pending() && !down_reason_) {
    first = earliest({first, rate_limit_.time_of_one(now)});
  }
  return first;
}

void VariableRequests::complete(Moment now) {
  for (auto open = requests_.begin(); open != requests_.end();) {
    open = complete(open->second, now) ? requests_.erase(open) : std::next(open);
  }
}

bool VariableRequests::complete(OpenRequest& open, Moment now) {
  const bool reads =
      open.phase == Phase::reading || open.phase == Phase::before || open.phase == Phase::after;
  if (!reads || !std::ranges::all_of(open.variables,
                                     [&](const auto& entry) { return entry->at >= open.since; })) {
    return false;
  }
  if (open.phase == Phase::reading) {
    finish_read(open, now);
    return true;
  }
  if (open.phase == Phase::after) {
    VariableReply reply{.done = true, .results = results_of(open), .before = open.before};
    replies_.answer(open.request, std::move(reply), now);
    return true;
  }
  if (const std::string reason = prepare(open); !reason.empty()) {
    replies_.report_write(open.request, false, reason, now);
    replies_.refuse(open.request, reason, now, results_of(open));
    return true;
  }
  open.phase = Phase::writing;
  return false;
}

void VariableRequests::finish_read(const OpenRequest& open, Moment now) {
  std::size_t bytes = 0;
  for (const auto& entry : open.variables) {
    bytes += entry->reading ? entry->reading->length : 0;
  }
  if (bytes > fabric::most_variable_bytes) {
    replies_.refuse(
        open.request,
        fmt::format("they have {} bytes together; at most {} go into one answer, so ask for "
                    "fewer at once",
                    bytes, fabric::most_variable_bytes),
        now);
    return;
  }
  replies_.answer(open.request, {.done = true, .results = results_of(open)}, now);
}

void VariableRequests::on_time(Moment now) {
  for (auto open = requests_.begin(); open != requests_.end();) {
    // A running write ends with the controller's response.
    if (open->second.deadline > now.steady || open->second.phase == Phase::writing) {
      ++open;
      continue;
    }
    expire(open->second, now);
    open = requests_.erase(open);
  }
}

void VariableRequests::expire(OpenRequest& open, Moment now) {
  const auto waited = ms(patience_of(open.request));
  if (open.phase == Phase::after) {
    replies_.refuse(open.request, fmt::format("written, but not read back within {} ms", waited),
                    now);
    return;
  }
  replies_.refuse(
      open.request,
      pending()
          ? fmt::format("{} has not answered within {} ms", machine_, waited)
          : fmt::format("{} could not be asked within {} ms: calls have priority, {} requests "
                        "wait, and {} requests a second are allowed",
                        machine_, waited, requests_.size(), settings_.requests_per_second),
      now);
}

}  // namespace millrace::gateway::variables
