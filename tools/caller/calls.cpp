#include "tools/caller/calls.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "fabric/messages.hpp"
#include "gateway/call_record.hpp"

namespace millrace::tools::caller {

namespace {

std::string seconds_of(std::chrono::nanoseconds duration) {
  return fmt::format("{:g} s", std::chrono::duration<double>(duration).count());
}

}  // namespace

tl::expected<fabric::CallId, std::string> Calls::add(const Order& order, Moment now) {
  if (order.state == 0) {
    return tl::unexpected(std::string("a request with state 0 is not a call; expected 1 or more"));
  }
  if (order.text.size() > fabric::max_text) {
    return tl::unexpected(fmt::format("the request has {} bytes, at most {} fit", order.text.size(),
                                      fabric::max_text));
  }
  if (const auto other = by_channel_.find(order.key); other != by_channel_.end()) {
    return tl::unexpected(fmt::format("call {} is still pending in channel {}",
                                      other->second.to_string(), order.key.to_string()));
  }
  ++last_.number;
  const fabric::CallId id = last_;
  Open open{.order = order, .seen = now.wall};
  if (order.patience != std::chrono::nanoseconds{}) {
    open.until = now.steady + order.patience;
  }
  tell(id, open, fabric::EventKind::seen, now);
  open_.emplace(id, std::move(open));
  by_channel_.emplace(order.key, id);
  carry_out(dispatcher_.add({.id = id,
                             .key = order.as.value_or(order.key),
                             .request = {order.uuid, order.text, order.state},
                             .seen = now.wall}),
            now);
  return id;
}

void Calls::give_up(const fabric::CallId& call, const fabric::Message& reason, Moment now) {
  end(call, std::nullopt, reason, now);
}

void Calls::on_instance_ready(const fabric::InstanceIdentity& identity, Moment now) {
  carry_out(dispatcher_.on_instance_ready(identity), now);
}

void Calls::on_instance_gone(const fabric::InstanceId& instance, Moment now) {
  carry_out(dispatcher_.on_instance_gone(instance, now.steady), now);
}

void Calls::on_load(const fabric::InstanceLoad& load, Moment now) {
  carry_out(dispatcher_.on_load(load, now.steady), now);
}

void Calls::on_reply(const fabric::Reply& reply, Moment now) {
  const auto found = open_.find(reply.call);
  if (found == open_.end() || reply.key != found->second.order.key ||
      reply.asked_text != found->second.order.text ||
      reply.asked_state != found->second.order.state ||
      std::ranges::find(found->second.asked, reply.instance) == found->second.asked.end()) {
    return;
  }
  if (reply.kind == fabric::ReplyKind::declined) {
    decline(reply, now);
    return;
  }
  if (!fabric::is_known(reply)) {
    end(reply.call, std::nullopt, base::messages::response_unknown(), now);
    return;
  }
  const bool last = reply.kind == fabric::ReplyKind::final;
  tell(reply.call, found->second, last ? fabric::EventKind::replied : fabric::EventKind::interim,
       now, &reply);
  if (last) {
    end(reply.call, reply, {}, now);
  } else {
    out_.emplace_back(Interim{reply});
  }
}

void Calls::on_unpublished(const fabric::CallId& call, const fabric::Message& reason, Moment now) {
  end(call, std::nullopt, reason, now);
}

void Calls::on_time(Moment now) {
  carry_out(dispatcher_.on_time(now.steady), now);
  for (const fabric::RequestKey& request : answered_.due(now.steady)) {
    out_.emplace_back(Withdraw{request});
  }
  std::vector<fabric::CallId> over;
  for (const auto& [id, open] : open_) {
    if (open.until && *open.until <= now.steady) {
      over.push_back(id);
    }
  }
  for (const fabric::CallId& id : over) {
    const Open& open = open_.at(id);
    const fabric::Message why =
        open.published
            ? base::messages::instance_has_not_responded()
            : dispatcher_.why_unserved(open.order.uuid, open.order.as.value_or(open.order.key))
                  .value_or(open.reason);
    end(id, std::nullopt, base::messages::no_response_within(seconds_of(open.order.patience), why),
        now);
  }
}

std::optional<SteadyTime> Calls::next_time() const {
  std::optional<SteadyTime> next = dispatcher_.next_time();
  if (const auto due = answered_.next_time(); due && (!next || *due < *next)) {
    next = due;
  }
  for (const auto& [id, open] : open_) {
    if (open.until && (!next || *open.until < *next)) {
      next = open.until;
    }
  }
  return next;
}

bool Calls::is_given_out(const fabric::CallId& call) const {
  const auto open = open_.find(call);
  return open != open_.end() && open->second.published;
}

void Calls::leave(const fabric::Message& reason, Moment now) {
  while (!open_.empty()) {
    end(open_.begin()->first, std::nullopt, reason, now);
  }
  for (const fabric::RequestKey& request : answered_.take_all()) {
    out_.emplace_back(Withdraw{request});
  }
}

Actions Calls::take_actions() {
  return std::exchange(out_, {});
}

void Calls::carry_out(const gateway::dispatch::Decisions& decisions, Moment now) {
  for (const gateway::dispatch::Decision& decision : decisions) {
    if (const auto* given = std::get_if<gateway::dispatch::Assign>(&decision)) {
      give(*given, now);
    } else if (const auto* back = std::get_if<gateway::dispatch::Unassign>(&decision)) {
      take_back(*back, now);
    } else if (const auto* explain = std::get_if<gateway::dispatch::Explain>(&decision)) {
      if (const auto open = open_.find(explain->call); open != open_.end()) {
        open->second.reason = explain->reason;
      }
    }
  }
}

void Calls::give(const gateway::dispatch::Assign& give, Moment now) {
  const gateway::Attempt& attempt = give.assignment.attempt;
  Open& open = open_.at(give.call);
  open.attempt = attempt.number;
  open.asked.push_back(attempt.instance);
  if (std::ranges::count(open.standing, attempt.instance) == 0) {
    open.standing.push_back(attempt.instance);
  }
  answered_.replace({open.order.key, last_.epoch, attempt.instance});
  open.published = true;
  open.given = open.given.value_or(now.steady);
  dispatcher_.on_published(give.call, now.steady);
  out_.emplace_back(Publish{{.key = open.order.key,
                             .call = give.call,
                             .attempt = attempt.number,
                             .assigned = attempt.instance,
                             .uuid = open.order.uuid,
                             .text = open.order.text,
                             .state = open.order.state,
                             .deadline = open.order.patience == std::chrono::nanoseconds{}
                                             ? fabric::Time{}
                                             : open.seen + open.order.patience,
                             .seen = open.seen,
                             .dispatched = now.wall,
                             .may_wait = give.assignment.waits,
                             .replayed = open.order.replayed}});
  tell(give.call, open, fabric::EventKind::dispatched, now, nullptr,
       std::string(give.assignment.instance_name()));
}

void Calls::take_back(const gateway::dispatch::Unassign& back, Moment now) {
  Open& open = open_.at(back.call);
  tell(back.call, open, fabric::EventKind::lost, now, nullptr, back.reason);
  if (back.held) {
    end(back.call, std::nullopt, base::messages::instance_lost_for_good(), now);
    return;
  }
  open.published = false;
  open.reason = back.reason;
  withdraw(open, open.asked.back());
}

void Calls::withdraw(Open& open, const fabric::InstanceId& instance) {
  if (std::erase(open.standing, instance) > 0) {
    out_.emplace_back(Withdraw{{open.order.key, last_.epoch, instance}});
  }
}

/// Only the newest attempt can be declined, and only while it is pending.
void Calls::decline(const fabric::Reply& reply, Moment now) {
  Open& open = open_.at(reply.call);
  if (!open.published || reply.attempt != open.attempt || reply.instance != open.asked.back()) {
    return;
  }
  open.published = false;
  withdraw(open, reply.instance);
  carry_out(dispatcher_.decline(reply.call, now.steady), now);
}

void Calls::end(fabric::CallId call, std::optional<fabric::Reply> reply,
                const fabric::Message& reason, Moment now) {
  const auto found = open_.find(call);
  if (found == open_.end()) {
    return;
  }
  Open open = std::move(found->second);
  open_.erase(found);
  by_channel_.erase(open.order.key);
  if (!reply) {
    tell(call, open, fabric::EventKind::withdrawn, now, nullptr, reason);
  }
  if (reply && std::erase(open.standing, reply->instance) > 0) {
    answered_.add({open.order.key, last_.epoch, reply->instance}, now.steady);
  }
  while (!open.standing.empty()) {
    withdraw(open, open.standing.back());
  }
  out_.emplace_back(Ended{.call = call,
                          .key = open.order.key,
                          .reply = std::move(reply),
                          .reason = reason,
                          .took = now.steady - open.given.value_or(now.steady)});
  carry_out(dispatcher_.remove(call), now);
}

void Calls::tell(const fabric::CallId& call, const Open& open, fabric::EventKind kind, Moment now,
                 const fabric::Reply* reply, const fabric::Message& detail) {
  const bool request = kind == fabric::EventKind::seen;
  out_.emplace_back(
      Notice{{.key = open.order.key,
              .call = call,
              .attempt = open.attempt,
              .kind = kind,
              .at = now.wall,
              .instance = reply != nullptr
                              ? reply->instance
                              : (open.asked.empty() ? fabric::InstanceId{} : open.asked.back()),
              .uuid = open.order.uuid,
              .text = reply != nullptr ? reply->text : (request ? open.order.text : std::string()),
              .state = reply != nullptr ? reply->state : (request ? open.order.state : 0),
              .detail = detail,
              .replayed = open.order.replayed}});
}

}  // namespace millrace::tools::caller
