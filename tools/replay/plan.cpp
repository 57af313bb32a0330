#include "tools/replay/plan.hpp"

#include <algorithm>

namespace millrace::tools::replay {

namespace {

/// How long the request stood in the channel before its dispatch, by the gateway's clock.
nanoseconds before_dispatch(const fabric::Request& request) {
  const bool known = request.seen != fabric::Time{} && request.dispatched > request.seen;
  return known ? request.dispatched - request.seen : nanoseconds{};
}

nanoseconds work_of(const fabric::Reply& reply) {
  const bool known = reply.received != fabric::Time{} && reply.answered > reply.received;
  return known ? reply.answered - reply.received : nanoseconds{};
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

void PlanBuilder::add(const recording::Entry& entry) {
  if (const auto* request = std::get_if<fabric::Request>(&entry.sample)) {
    add(*request, entry);
  } else if (const auto* reply = std::get_if<fabric::Reply>(&entry.sample)) {
    add(*reply, entry);
  } else if (const auto* event = std::get_if<fabric::Event>(&entry.sample)) {
    add(*event, entry);
  } else if (const auto* withdrawal = std::get_if<recording::Withdrawal>(&entry.sample)) {
    if (const auto place = found_.find(withdrawal->call); place != found_.end()) {
      place->second.withdrawn = entry.at;
    }
  }
}

void PlanBuilder::add(const fabric::Request& request, const recording::Entry& entry) {
  Found& found = found_[request.call];
  if (found.by_request) {
    // Dispatched again: the earlier withdrawal was not that of the program.
    found.withdrawn.reset();
    return;
  }
  if (!filter_.takes(entry)) {
    return;
  }
  found.by_request = true;
  found.call = PlannedCall{.recorded = request.call,
                           .channel = request.key,
                           .uuid = request.uuid,
                           .text = request.text,
                           .state = request.state};
  found.asked = entry.at - before_dispatch(request);
  found.withheld = entry.withheld.has_value();
}

void PlanBuilder::add(const fabric::Reply& reply, const recording::Entry& entry) {
  if (reply.kind != fabric::ReplyKind::interim && reply.kind != fabric::ReplyKind::final) {
    return;  // Declined: the response is that of another instance.
  }
  Found& found = found_[reply.call];
  const Heard heard{entry.at, TimedAnswer{.answer = {reply.text, reply.state, entry.withheld},
                                          .work = work_of(reply)}};
  if (reply.kind == fabric::ReplyKind::interim) {
    // An instance that is discovered again delivers its last reply again.
    if (found.interim.empty() || found.interim.back().answer.answer != heard.answer.answer) {
      found.interim.push_back(heard);
    }
  } else if (!found.answer) {
    found.answer = heard;
  }
}

void PlanBuilder::add(const fabric::Event& event, const recording::Entry& entry) {
  const Heard heard{entry.at, TimedAnswer{.answer = {event.text, event.state, entry.withheld}}};
  if (event.kind == fabric::EventKind::seen) {
    Found& found = found_[event.call];
    if (!found.call && filter_.takes(entry)) {
      found.call = PlannedCall{.recorded = event.call,
                               .channel = event.key,
                               .uuid = event.uuid,
                               .text = event.text,
                               .state = event.state};
      found.asked = entry.at;
      found.withheld = entry.withheld.has_value();
    }
  } else if (event.kind == fabric::EventKind::replied) {
    found_[event.call].replied = heard;
  } else if (event.kind == fabric::EventKind::withdrawn) {
    Found& found = found_[event.call];
    found.given_up = true;
    found.withdrawn = entry.at;
  } else if (event.kind == fabric::EventKind::written) {
    Found& found = found_[event.call];
    found.given_up = false;
    found.settled = heard;
  }
}

PlannedCall PlanBuilder::planned(const Found& found) {
  PlannedCall call = *found.call;
  const auto since = [&](fabric::Time at) { return std::max(nanoseconds{}, at - found.asked); };
  const auto timed = [&](const Heard& heard) {
    TimedAnswer answer = heard.answer;
    answer.after = since(heard.at);
    return answer;
  };
  for (const Heard& heard : found.interim) {
    call.interim.push_back(timed(heard));
  }
  if (const auto& answer = found.answer ? found.answer : found.replied; answer && !found.given_up) {
    call.answer = timed(*answer);
  }
  // Unless the gateway wrote the service's response.
  if (found.settled && (!call.answer || call.answer->answer != found.settled->answer.answer)) {
    call.settled = timed(*found.settled);
  }
  // A gateway also withdraws a request after its response.
  if (found.withdrawn && !call.answer && !call.settled) {
    call.withdrawn_after = since(*found.withdrawn);
  }
  return call;
}

Plan PlanBuilder::build(const PlanOptions& options) const {
  Plan plan;
  std::vector<const Found*> order;
  for (const auto& [id, found] : found_) {
    if (!found.call) {
      continue;
    }
    const std::string impossible = why_impossible(*found.call);
    if (found.withheld) {
      plan.skipped.push_back(
          {id, found.call->channel, "its request text is not in the recording (--without-text)"});
    } else if (!impossible.empty()) {
      plan.skipped.push_back({id, found.call->channel, impossible});
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

}  // namespace millrace::tools::replay
