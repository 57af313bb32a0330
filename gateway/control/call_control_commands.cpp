// What an operator wants of a channel's call.
#include <utility>

#include "gateway/control/call_control.hpp"

namespace millrace::gateway::control {

ChannelActions CallControl::on_answer(const fabric::ChannelKey& key, const fabric::CallId& call,
                                      const OperatorAnswer& answer, Verdict& verdict, Moment now) {
  const channel::ChannelSession* const there = find(key);
  const fabric::Awaited awaited = there != nullptr && there->call() != nullptr
                                      ? there->call()->awaited
                                      : fabric::Awaited::response_state;
  auto response = Response::of(answer.text, answer.state, awaited);
  if (!response) {
    verdict = {false, "the answer " + response.error() + "; nothing is written"};
  } else if (channel::ChannelSession* session = find_pending(key, call, verdict)) {
    run(*session, session->settle({*std::move(response), answer.by}, now), now);
    verdict = {true, "the answer is on its way to the program"};
  }
  return finish();
}

ChannelActions CallControl::on_retry(const fabric::ChannelKey& key, const fabric::CallId& call,
                                     const std::string& by, Verdict& verdict, Moment now) {
  if (channel::ChannelSession* session = find_pending(key, call, verdict)) {
    // It would run whenever an instance comes, long after somebody has looked at the machine.
    if (const auto unserved = dispatcher_.why_unserved(session->call()->request.uuid, key)) {
      verdict = {false, *unserved + "; start the service, then retry"};
      return finish();
    }
    forget_standing(key);
    run(*session, session->retry(by, now), now);
    carry_out(dispatcher_.add(*session->call()), now);
    verdict = {true, session->status().reason};
  }
  return finish();
}

channel::ChannelSession* CallControl::find_pending(const fabric::ChannelKey& key,
                                                   const fabric::CallId& call, Verdict& verdict) {
  channel::ChannelSession* session = find(key);
  if (session != nullptr && session->status().state == fabric::ChannelState::unserved) {
    verdict = {false, "the program's request is left alone, so there is no call to act on: " +
                          session->status().reason};
    return nullptr;
  }
  if (session == nullptr || session->call() == nullptr) {
    verdict = {false, "no call is pending on this channel"};
    return nullptr;
  }
  if (session->call()->id != call) {
    verdict = {false, "another call is pending by now: " + session->call()->id.to_string()};
    return nullptr;
  }
  if (session->call()->answer) {
    verdict = {false, "the call's answer is being written"};
    return nullptr;
  }
  return session;
}

}  // namespace millrace::gateway::control
