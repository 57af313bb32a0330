// What the steps of a channel mean for calls, and how a found request goes on: it is skipped,
// accepted with a new number, blocked for an operator, or answered here.
#include <string>

#include "base/messages/catalogue.hpp"
#include "fabric/cases.hpp"
#include "fabric/channel_scope.hpp"
#include "gateway/core/core.hpp"

namespace millrace::gateway::core {

using channel::ChannelOutput;
using channel::OpenCall;

void Core::read_channel(const fabric::ChannelKey& key, const ServiceSnapshot& snapshot) {
  if (snapshot.has(Variable::request_state) && snapshot.request_state == 0) {
    admission_.predecessors.on_zero_read(key);
    context_.blocked.forget(key);
  }
  step(key, [&](channel::Channel& channel) { channel.on_read(snapshot, now_); });
}

void Core::follow(channel::Channel& channel) {
  const channel::ChannelNews news = channel.take_news();
  if (news.wake_at) {
    channels_.wake_at(channel.key(), *news.wake_at);
  }
  if (news.reads) {
    admission_.predecessors.on_read_started(channel.key());
  }
  if (news.published) {
    dispatcher_.on_published(*news.published, now_.steady);
  }
  if (news.resumed) {
    apply(dispatcher_.resume(channel.call(), now_.steady));
  }
  if (news.declined) {
    apply(dispatcher_.decline(*news.declined, now_.steady));
  }
  if (news.ended) {
    if (news.ended->written) {
      // Whatever else a predecessor has left here came after this call.
      admission_.predecessors.on_answered(channel.key(), news.ended->call);
    }
    apply(dispatcher_.remove(news.ended->call));
  }
  if (news.found) {
    admit(channel);
  }
  context_.blocked.note(channel.status(), admission_.stopped.empty(), now_);
}

void Core::apply(const dispatch::Decisions& decisions) {
  for (const dispatch::Decision& decision : decisions) {
    std::visit(
        fabric::Cases{
            [&](const dispatch::Assign& assign) {
              change_call(*channels_.find(assign.key), [&](OpenCall& call, ChannelOutput& out) {
                call.assign(assign.assignment, out, now_);
              });
            },
            [&](const dispatch::Unassign& back) {
              change_call(*channels_.find(back.key), [&](OpenCall& call, ChannelOutput& out) {
                call.suspend(back.reason, back.held, out, now_);
              });
            },
            [&](const dispatch::Explain& explain) {
              change_call(*channels_.find(explain.key),
                          [&](OpenCall& call, ChannelOutput&) { call.explain(explain.reason); });
            }},
        decision);
  }
}

void Core::admit(channel::Channel& channel) {
  const std::string uuid = fabric::canonical_uuid(channel.found().uuid);
  const Policy policy = policy_of(channel.key(), uuid);
  const auto skip = [&](const fabric::Message& reason) {
    channel.leave_unserved(reason, policy, now_);
    follow(channel);
  };
  if (!admission_.stopped.empty()) {
    return skip(admission_.stopped);
  }
  const auto unserved = dispatcher_.serves(uuid, channel.key())
                            ? std::nullopt
                            : dispatcher_.why_unserved(channel.found().uuid, channel.key());
  const bool answered_here = unserved && channel.deadline_passed() && policy.unserved &&
                             policy.unserved->response_state != 0;
  if (unserved && !answered_here) {
    return skip(*unserved);
  }
  if (!admission_.numbers.available()) {
    return skip(base::messages::no_call_numbers());
  }
  if (!unserved && hold_for_predecessor(channel, uuid, policy)) {
    return;
  }
  channel.accept(next_id(), policy, now_);
  follow(channel);
  if (!unserved) {
    apply(dispatcher_.add(channel.call()));
    return;
  }
  const auto answer =
      Response::in_words("millrace: no service has this UUID", policy.unserved->response_state);
  change_call(channel, [&](OpenCall& call, ChannelOutput& out) {
    call.answer_locally({answer, base::messages::the_gateway()}, out, now_);
  });
}

bool Core::hold_for_predecessor(channel::Channel& channel, const std::string& canonical_uuid,
                                const Policy& policy) {
  const auto predecessor = admission_.predecessors.take(channel.key(), canonical_uuid);
  if (!predecessor || dispatcher_.delivery_of(canonical_uuid) != fabric::Delivery::at_most_once) {
    return false;
  }
  channel.accept(next_id(), policy, now_);
  follow(channel);
  change_call(channel, [&](OpenCall& call, ChannelOutput& out) {
    call.hold(base::messages::gateway_lost_held(predecessor->from), out, now_);
  });
  return true;
}

Policy Core::policy_of(const fabric::ChannelKey& key, const std::string& canonical_uuid) const {
  return options_.policies.of(std::string(fabric::machine_of(key.machine)), canonical_uuid);
}

fabric::CallId Core::next_id() {
  const fabric::CallId id = admission_.numbers.take();
  reserve_numbers();
  return id;
}

void Core::reserve_numbers() {
  if (const auto entry = admission_.numbers.reserve()) {
    host_.append(*entry, {.owner = Ticket::Owner::numbers});
  }
}

}  // namespace millrace::gateway::core
