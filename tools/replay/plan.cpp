#include "tools/replay/plan.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "fabric/channel_scope.hpp"

namespace millrace::tools::replay {

namespace {

using recording::Stage;
using recording::Step;

/// How long the request stood in the channel before its dispatch, by the gateway's clock.
nanoseconds before_dispatch(const fabric::Request& request) {
  const bool known = request.seen != fabric::Time{} && request.dispatched > request.seen;
  return known ? request.dispatched - request.seen : nanoseconds{};
}

/// In the instance, by its own clock.
nanoseconds work_of(const recording::Call& call, const Step& reply) {
  const Step* const received = call.of_attempt(Stage::received, reply.attempt);
  const bool known = received != nullptr && reply.by_service && reply.at > received->at;
  return known ? reply.at - received->at : nanoseconds{};
}

/// Why no controller can have made this request; empty if one can. Recordings are untrusted input.
std::string why_impossible(const PlannedCall& call) {
  const auto fits = [](const std::string& text) {
    return text.size() <= fabric::max_text && text.find('\0') == std::string::npos;
  };
  if (!fits(call.uuid) || !fits(call.text)) {
    return "its UUID or text is not a string of a controller (over 127 bytes, or with a NUL)";
  }
  if (call.state == 0) {
    return "its state is 0, which is not a request";
  }
  return {};
}

void cut_gaps(std::vector<PlannedCall>& calls, nanoseconds max_gap) {
  nanoseconds before{};
  nanoseconds cut{};
  for (PlannedCall& call : calls) {
    const nanoseconds gap = call.at - before;
    before = call.at;
    if (gap > max_gap) {
      cut += gap - max_gap;
    }
    call.at -= cut;
  }
}

}  // namespace

std::optional<nanoseconds> PlannedCall::end() const {
  if (answer) {
    return at + answer->after;
  }
  if (settled) {
    return at + settled->after;
  }
  if (withdrawn_after) {
    return at + *withdrawn_after;
  }
  return std::nullopt;
}

PlanBuilder::Found& PlanBuilder::found(const fabric::CallId& call) {
  return found_.try_emplace(call, Found{.call = recording::Call(call)}).first->second;
}

void PlanBuilder::add(const recording::Entry& entry) {
  const fabric::CallId call = call_of(entry);
  if (const auto* request = std::get_if<fabric::Request>(&entry.sample)) {
    add(*request, found(call), entry);
  } else if (const auto* event = std::get_if<fabric::Event>(&entry.sample)) {
    Found& planned = found(call);
    planned.call.add(entry);
    if (event->kind == fabric::EventKind::seen && !planned.planned && filter_.takes(entry)) {
      planned.planned = PlannedCall{.recorded = event->call,
                                    .channel = event->key,
                                    .uuid = event->uuid,
                                    .text = event->text,
                                    .state = event->state};
      planned.asked = entry.at;
      planned.withheld = entry.withheld.has_value();
    }
  } else if (std::holds_alternative<fabric::Reply>(entry.sample)) {
    found(call).call.add(entry);
  } else if (std::holds_alternative<recording::Withdrawal>(entry.sample)) {
    if (const auto place = found_.find(call); place != found_.end()) {
      place->second.taken_back = entry.at;
    }
  }
}

void PlanBuilder::add(const fabric::Request& request, Found& found, const recording::Entry& entry) {
  if (found.by_request) {
    // Dispatched again: the earlier withdrawal was not that of the program.
    found.taken_back.reset();
    found.call.add(entry);
    return;
  }
  if (!filter_.takes(entry)) {
    return;
  }
  found.call.add(entry);
  found.by_request = true;
  found.planned = PlannedCall{.recorded = request.call,
                              .channel = request.key,
                              .uuid = request.uuid,
                              .text = request.text,
                              .state = request.state};
  found.asked = entry.at - before_dispatch(request);
  found.withheld = entry.withheld.has_value();
}

PlannedCall PlanBuilder::planned(const Found& found) {
  PlannedCall call = *found.planned;
  const auto since = [&](fabric::Time at) { return std::max(nanoseconds{}, at - found.asked); };
  const auto timed = [&](const Step& step) {
    return TimedAnswer{.answer = {step.text, step.state, step.withheld},
                       .after = since(step.received),
                       .work = work_of(found.call, step)};
  };
  for (const Step& step : found.call.steps) {
    if (step.stage == Stage::interim_reply) {
      call.interim.push_back(timed(step));
    }
  }
  const bool given_up = found.call.outcome() == recording::Outcome::withdrawn;
  const Step* const answered = found.call.first(Stage::answered);
  const Step* const reply = answered != nullptr ? answered : found.call.last(Stage::replied);
  if (reply != nullptr && !given_up) {
    call.answer = timed(*reply);
  }
  // Unless the gateway wrote the service's response.
  if (const Step* const written = found.call.last(Stage::written)) {
    const TimedAnswer settled = timed(*written);
    if (!call.answer || call.answer->answer != settled.answer) {
      call.settled = settled;
    }
  }
  // A gateway also takes a request back after its response.
  if (!call.answer && !call.settled) {
    if (given_up) {
      call.withdrawn_after = since(found.call.end()->received);
    } else if (found.taken_back) {
      call.withdrawn_after = since(*found.taken_back);
    }
  }
  return call;
}

Plan PlanBuilder::build(const PlanOptions& options) const {
  Plan plan;
  std::vector<const Found*> order;
  for (const auto& [id, found] : found_) {
    if (!found.planned) {
      continue;
    }
    const std::string impossible = why_impossible(*found.planned);
    if (found.withheld) {
      plan.skipped.push_back({id, found.planned->channel,
                              "its request text is not in the recording (--without-text)"});
    } else if (!impossible.empty()) {
      plan.skipped.push_back({id, found.planned->channel, impossible});
    } else {
      order.push_back(&found);
    }
  }
  std::ranges::stable_sort(order, {}, &Found::asked);
  for (const Found* found : order) {
    plan.calls.push_back(planned(*found));
    plan.calls.back().at = found->asked - order.front()->asked;
  }
  if (options.max_gap != nanoseconds{}) {
    cut_gaps(plan.calls, options.max_gap);
  }
  return plan;
}

namespace {

std::optional<fabric::ChannelKey> parse_channel(std::string_view text) {
  const std::size_t slash = text.rfind('/');
  const std::string_view machine = text.substr(0, slash);
  if (slash == std::string_view::npos || !fabric::is_channel_owner(machine)) {
    return std::nullopt;
  }
  const auto number = base::text::parse_number<std::uint16_t>(text.substr(slash + 1));
  return number.value_or(0) != 0 ? std::optional(fabric::ChannelKey{std::string(machine), *number})
                                 : std::nullopt;
}

}  // namespace

tl::expected<void, std::string> ChannelMap::add(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals != std::string_view::npos) {
    const std::string_view left = text.substr(0, equals);
    const std::string_view right = text.substr(equals + 1);
    const auto from = parse_channel(left);
    const auto to = parse_channel(right);
    if (from && to) {
      channels_.insert_or_assign(*from, *to);
      return {};
    }
    if (fabric::is_machine_name(left) && fabric::is_machine_name(right)) {
      machines_.insert_or_assign(std::string(left), std::string(right));
      return {};
    }
  }
  return tl::unexpected(fmt::format(
      "'{}' maps no channel; expected RECORDED=OTHER, as in cnc/1=test/7 or cnc=test", text));
}

std::optional<fabric::ChannelKey> ChannelMap::find(const fabric::ChannelKey& recorded) const {
  if (const auto channel = channels_.find(recorded); channel != channels_.end()) {
    return channel->second;
  }
  if (const auto machine = machines_.find(recorded.machine); machine != machines_.end()) {
    return fabric::ChannelKey{machine->second, recorded.channel};
  }
  // A queue follows its machine.
  const std::string_view queue = fabric::queue_of(recorded.machine);
  if (const auto machine = machines_.find(std::string(fabric::machine_of(recorded.machine)));
      !queue.empty() && machine != machines_.end()) {
    return fabric::ChannelKey{fabric::queue_owner(machine->second, queue), recorded.channel};
  }
  return std::nullopt;
}

}  // namespace millrace::tools::replay
