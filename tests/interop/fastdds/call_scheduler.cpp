#include "call_scheduler.hpp"

#include <algorithm>

namespace millrace::tests::interop::fastdds {

namespace {

/// The text as bytes, as on the wire.
std::vector<std::uint8_t> bytes_of(const std::string& text) {
  return {text.begin(), text.end()};
}

bool same_call(const Request& request, const Request& other) {
  return key_of(request) == key_of(other) && request.number() == other.number();
}

}  // namespace

RequestKey key_of(const Request& request) {
  return {request.machine().c_str(), request.channel(), request.epoch()};
}

Reply CallScheduler::reply_to(const Request& request) const {
  Reply reply;
  reply.machine(request.machine());
  reply.channel(request.channel());
  reply.instance(own_);
  reply.epoch(request.epoch());
  reply.number(request.number());
  reply.attempt(request.attempt());
  reply.kind(reply_kind::final);
  reply.code(service_code::ok);
  reply.asked_text(request.text());
  reply.asked_state(request.state());
  reply.replayed(request.replayed());
  return reply;
}

CallScheduler::Call* CallScheduler::find(const Request& request) {
  for (std::deque<Call>* calls : {&waiting_, &running_}) {
    for (Call& call : *calls) {
      if (same_call(call.request, request)) {
        return &call;
      }
    }
  }
  return nullptr;
}

/// Gives up all calls of this key except one.
void CallScheduler::give_up(const RequestKey& key, std::uint64_t but_number) {
  const auto is_over = [&](const Call& call) {
    return key_of(call.request) == key && call.request.number() != but_number;
  };
  counters_.cancelled() += std::erase_if(waiting_, is_over);
  for (Call& call : running_) {
    if (is_over(call) && !call.over) {
      call.over = true;
      ++counters_.cancelled();
    }
  }
}

/// Gives up the earlier calls that this request supersedes.
void CallScheduler::supersede(const Request& by) {
  RequestKey key = key_of(by);
  give_up(key, by.number());
  if (by.succeeds() != 0 && by.succeeds() != by.epoch()) {
    key.epoch = by.succeeds();
    give_up(key, 0);
    answered_.erase(key);
  }
}

bool CallScheduler::must_decline(const Request& request) const {
  const bool full = running_.size() + waiting_.size() >= room_;
  const auto before = declined_.find(key_of(request));
  return leaving_ || (full && !request.may_wait()) ||
         (before != declined_.end() &&
          before->second == std::pair(request.number(), request.attempt()));
}

std::optional<Reply> CallScheduler::take(const Request& request, Nanoseconds now) {
  if (request.assigned() != own_) {
    return std::nullopt;
  }
  supersede(request);
  if (Call* const call = find(request)) {
    // Requested again while it runs: its answer goes to the latest attempt.
    call->request.attempt(request.attempt());
    call->over = false;
    return std::nullopt;
  }
  if (const auto known = answered_.find(key_of(request));
      known != answered_.end() && known->second.number() == request.number()) {
    Reply reply = known->second;
    reply.attempt(request.attempt());
    reply.code(service_code::repeated);
    ++counters_.repeated();
    return reply;
  }
  if (must_decline(request)) {
    declined_[key_of(request)] = {request.number(), request.attempt()};
    Reply reply = reply_to(request);
    reply.kind(reply_kind::declined);
    reply.text(bytes_of(leaving_ ? "leaving" : "no room"));
    ++counters_.declined();
    return reply;
  }
  counters_.last_call(now);
  waiting_.push_back({.request = request, .received = now});
  return std::nullopt;
}

void CallScheduler::take_back(const RequestKey& key) {
  give_up(key, 0);
}

std::optional<Request> CallScheduler::begin(Nanoseconds now) {
  if (waiting_.empty() || running_.size() >= room_) {
    return std::nullopt;
  }
  running_.push_back(waiting_.front());
  waiting_.pop_front();
  running_.back().started = now;
  return running_.back().request;
}

std::optional<Reply> CallScheduler::finish(const Request& request, const std::string& text,
                                           std::uint32_t state, Nanoseconds now) {
  const auto call = std::ranges::find_if(
      running_, [&](const Call& each) { return same_call(each.request, request); });
  if (call == running_.end()) {
    return std::nullopt;
  }
  const Call ended = *call;
  running_.erase(call);
  if (ended.over) {
    return std::nullopt;
  }
  Reply reply = reply_to(ended.request);
  reply.text(bytes_of(text));
  reply.state(state);
  reply.received(ended.received);
  reply.started(ended.started);
  reply.answered(now);
  ++counters_.answered();
  answered_.insert_or_assign(key_of(request), reply);
  return reply;
}

InstanceLoad CallScheduler::load() const {
  InstanceLoad load = counters_;
  load.instance(own_);
  for (const std::deque<Call>* calls : {&running_, &waiting_}) {
    for (const Call& call : *calls) {
      CallId id;
      id.epoch(call.request.epoch());
      id.number(call.request.number());
      load.calls().push_back(id);
    }
  }
  load.waiting(static_cast<std::uint32_t>(waiting_.size()));
  return load;
}

}  // namespace millrace::tests::interop::fastdds
