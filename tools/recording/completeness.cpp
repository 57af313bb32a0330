#include "tools/recording/completeness.hpp"

#include <algorithm>

namespace millrace::tools::recording {

namespace {

using fabric::EventKind;

/// Topics have no common order, and lost samples are sent again within milliseconds: after this
/// time a missing sample does not come any more.
constexpr auto settle_time = std::chrono::seconds(2);
/// At the end, samples that are still on their way are not missing.
constexpr auto last_moment = std::chrono::milliseconds(100);
template <typename T>
bool contains(const std::vector<T>& all, const T& wanted) {
  return std::ranges::find(all, wanted) != all.end();
}

template <typename T>
void insert(std::vector<T>& all, const T& added) {
  if (!contains(all, added)) {
    all.push_back(added);
  }
}

template <typename T>
std::uint64_t lacking(const std::vector<T>& expected, const std::vector<T>& there) {
  return static_cast<std::uint64_t>(
      std::ranges::count_if(expected, [&](const T& wanted) { return !contains(there, wanted); }));
}

}  // namespace

void Completeness::add(const Entry& entry, bool wanted) {
  settle(entry.at - settle_time);
  if (const auto* event = std::get_if<fabric::Event>(&entry.sample)) {
    add_event(*event, wanted, entry.at);
  } else if (const auto* request = std::get_if<fabric::Request>(&entry.sample)) {
    if (is_open(request->call, entry.at)) {
      insert(trace_of(request->call, wanted).requested, request->attempt);
      on_channel(request->key, request->call, entry.at);
    }
  } else if (const auto* reply = std::get_if<fabric::Reply>(&entry.sample)) {
    if (is_open(reply->call, entry.at)) {
      Trace& trace = trace_of(reply->call, wanted);
      on_channel(reply->key, reply->call, entry.at);
      if (reply->kind == fabric::ReplyKind::final) {
        insert(trace.replies, reply->instance);
      } else {
        insert(trace.interim_replies, reply->state);
      }
    }
  } else if (const auto* status = std::get_if<fabric::ChannelStatus>(&entry.sample)) {
    on_status(*status, entry.at);
  } else if (const auto* machine = std::get_if<fabric::MachineStatus>(&entry.sample)) {
    on_machine(*machine);
  }
}

void Completeness::on_machine(const fabric::MachineStatus& status) {
  if (status.epoch == 0) {
    return;  // The gateway is gone.
  }
  const auto [process, is_new] =
      gateways_[status.epoch].processes.try_emplace(status.gateway, status.claimed);
  process->second = std::min(process->second, status.claimed);
}

void Completeness::add_event(const fabric::Event& event, bool wanted, fabric::Time at) {
  if (event.call == fabric::CallId{}) {
    return;  // A request without a service is not a call yet.
  }
  const bool was_open = is_open(event.call, at);
  const bool is_new = event.kind == EventKind::seen && on_seen(event, at);
  if (!is_new && !was_open) {
    return;
  }
  Trace& trace = trace_of(event.call, wanted);
  on_channel(event.key, event.call, at);
  switch (event.kind) {
    case EventKind::seen:
      trace.seen = true;
      break;
    case EventKind::dispatched:
      insert(trace.dispatched, event.attempt);
      break;
    case EventKind::interim:
      insert(trace.interim_written, event.state);
      break;
    case EventKind::replied:
      trace.replied = true;
      if (event.instance != fabric::InstanceId{}) {
        trace.answered_by = event.instance;
        insert(trace.named, event.attempt);
      }
      break;
    case EventKind::refused:
      trace.refused = true;
      insert(trace.named, event.attempt);
      break;
    case EventKind::written:
    case EventKind::withdrawn:
      trace.ended = true;
      trace.written = event.kind == EventKind::written;
      set_over(event.call, trace, at);
      break;
    case EventKind::unserved:
    case EventKind::lost:
    case EventKind::late:
    case EventKind::held:
      break;
  }
}

/// False for a call that is known.
bool Completeness::on_seen(const fabric::Event& event, fabric::Time at) {
  const fabric::CallId& call = event.call;
  Gateway& gateway = gateways_.at(call.epoch);
  if (call.number <= gateway.last) {
    return false;
  }
  if (gateway.first == 0) {
    // Earlier calls may be of the time before the recording.
    gateway.first = call.number;
    std::erase_if(traces_, [&](const auto& trace) {
      return trace.first.epoch == call.epoch && trace.first.number < call.number;
    });
  } else if (call.number > gateway.last + 1) {
    const fabric::CallId last_in_it{call.epoch, call.number - 1};
    gaps_.insert_or_assign(last_in_it,
                           Gap{gateway.last + 1, last_in_it.number, gateway.last_at, event.at, at});
    gap_order_.push_back(last_in_it);
  }
  gateway.last = call.number;
  gateway.last_at = event.at;
  return true;
}

/// A channel has one call after the other, with higher numbers.
void Completeness::on_channel(const fabric::ChannelKey& key, const fabric::CallId& call,
                              fabric::Time at) {
  fabric::CallId& current = current_[key];
  if (current == call) {
    return;
  }
  if (current.epoch == call.epoch && current.number > call.number) {
    // Another topic was faster.
    if (const auto trace = traces_.find(call); trace != traces_.end()) {
      set_over(call, trace->second, at);
    }
    return;
  }
  if (const auto before = traces_.find(current); before != traces_.end()) {
    if (current.epoch == call.epoch) {
      set_over(current, before->second, at);
    } else if (!before->second.over) {
      // Another gateway has the channel now; the first one does not publish how the call ended.
      traces_.erase(before);
    }
  }
  current = call;
}

void Completeness::on_status(const fabric::ChannelStatus& status, fabric::Time at) {
  const auto current = current_.find(status.key);
  if (current == current_.end()) {
    return;
  }
  const auto trace = traces_.find(current->second);
  if (trace == traces_.end() || trace->second.ended) {
    return;
  }
  if (status.call == current->second) {
    trace->second.over.reset();
  } else if (status.call != fabric::CallId{} || status.state != fabric::ChannelState::link_down) {
    set_over(trace->first, trace->second, at);
  } else {
    // The gateway is gone, or gave the channel away: it does not publish how the call ended.
    traces_.erase(trace);
  }
}

/// Not judged yet, and not of the time before the recording.
bool Completeness::is_open(const fabric::CallId& call, fabric::Time at) {
  const auto [place, is_new] = gateways_.try_emplace(call.epoch);
  if (is_new) {
    strangers_.emplace_back(at, call.epoch);
  }
  const Gateway& gateway = place->second;
  return traces_.contains(call) ||
         ((call.number > gateway.last || in_a_gap(call)) && !gateway.judged.contains(call.number));
}

Completeness::Trace& Completeness::trace_of(const fabric::CallId& call, bool wanted) {
  Trace& trace = traces_[call];
  trace.wanted = trace.wanted || wanted;
  return trace;
}

void Completeness::set_over(const fabric::CallId& call, Trace& trace, fabric::Time at) {
  if (!trace.over) {
    trace.over = at;
    over_.emplace_back(at, call);
  }
}

bool Completeness::in_a_gap(const fabric::CallId& call) const {
  const auto gap = gaps_.lower_bound(call);
  return gap != gaps_.end() && gap->first.epoch == call.epoch && gap->second.from <= call.number;
}

void Completeness::forget_strangers(fabric::Time until) {
  while (!strangers_.empty() && strangers_.front().first <= until) {
    const std::uint64_t epoch = strangers_.front().second;
    strangers_.pop_front();
    const auto stranger = gateways_.find(epoch);
    if (stranger == gateways_.end() || !stranger->second.processes.empty()) {
      continue;
    }
    gateways_.erase(stranger);
    const auto is_its = [&](const auto& call) { return call.first.epoch == epoch; };
    std::erase_if(traces_, is_its);
    std::erase_if(gaps_, is_its);
    std::erase_if(gap_order_, [&](const fabric::CallId& gap) { return gap.epoch == epoch; });
  }
}

void Completeness::settle(fabric::Time until) {
  forget_strangers(until);
  while (!over_.empty() && over_.front().first <= until) {
    const auto [at, call] = over_.front();
    over_.pop_front();
    const auto trace = traces_.find(call);
    // It is not over: its channel showed it again.
    if (trace != traces_.end() && trace->second.over == at) {
      judge(trace, false);
    }
  }
  settle_gaps(until);
}

void Completeness::settle_gaps(fabric::Time until) {
  while (!gap_order_.empty()) {
    const auto gap = gaps_.find(gap_order_.front());
    if (gap->second.received > until) {
      return;
    }
    missing_.unseen += unseen_in(gap->first.epoch, gap->second);
    gaps_.erase(gap);
    gap_order_.pop_front();
  }
}

/// The number of calls in a gap of which nothing was received; the others are judged by their
/// samples.
std::uint64_t Completeness::unseen_in(std::uint64_t epoch, const Gap& gap) {
  Gateway& gateway = gateways_.at(epoch);
  const auto first = gateway.judged.lower_bound(gap.from);
  const auto last = gateway.judged.upper_bound(gap.to);
  auto known = static_cast<std::uint64_t>(std::distance(first, last));
  gateway.judged.erase(first, last);
  if (gap.to - gap.from < traces_.size()) {
    for (std::uint64_t number = gap.from; number <= gap.to; ++number) {
      known += traces_.contains({epoch, number}) ? 1U : 0U;
    }
  } else {
    known += static_cast<std::uint64_t>(std::ranges::count_if(traces_, [&](const auto& trace) {
      return trace.first.epoch == epoch && gap.from <= trace.first.number &&
             trace.first.number <= gap.to;
    }));
  }
  // Another process of the gateway continues after the numbers that the previous one may have used.
  const bool began_again = std::ranges::any_of(gateway.processes, [&](const auto& process) {
    return gap.before < process.second && process.second <= gap.after;
  });
  return began_again ? 0 : gap.to - gap.from + 1 - known;
}

void Completeness::judge(Traces::iterator found, bool at_once) {
  const fabric::CallId call = found->first;
  const Trace trace = std::move(found->second);
  traces_.erase(found);
  Gateway& gateway = gateways_.at(call.epoch);
  if (gateway.first == 0 || call.number < gateway.first) {
    return;  // Before the recording.
  }
  if (call.number > gateway.last || in_a_gap(call)) {
    gateway.judged.insert(call.number);
  }
  if (!trace.wanted) {
    return;
  }
  std::vector<std::uint32_t> attempts = trace.named;
  for (const std::uint32_t attempt : trace.requested) {
    insert(attempts, attempt);
  }
  Missing lack;
  lack.requests = lacking(trace.dispatched, trace.requested);
  lack.replies = lacking(trace.interim_written, trace.interim_replies);
  lack.replies += trace.answered_by && !contains(trace.replies, *trace.answered_by) ? 1U : 0U;
  lack.replies += !trace.answered_by && trace.refused && trace.replies.empty() ? 1U : 0U;
  lack.events = lacking(attempts, trace.dispatched);
  lack.events += trace.seen ? 0U : 1U;
  lack.events += trace.ended ? 0U : 1U;
  lack.events += trace.written && !trace.replied ? 1U : 0U;
  if (lack == Missing{}) {
    ++missing_.complete;
  } else if (trace.ended || !at_once) {
    ++missing_.incomplete;
    missing_.requests += lack.requests;
    missing_.replies += lack.replies;
    missing_.events += lack.events;
  }
}

void Completeness::finish(fabric::Time now) {
  forget_strangers(now);
  settle(now - last_moment);
  settle_gaps(now);
  while (!over_.empty()) {
    const auto [at, call] = over_.front();
    over_.pop_front();
    const auto trace = traces_.find(call);
    if (trace != traces_.end() && trace->second.over == at) {
      judge(trace, true);
    }
  }
}

}  // namespace millrace::tools::recording
