// What an operator wants of a channel's call.
#include <utility>

#include "gateway/core/core.hpp"

namespace millrace::gateway::core {

CommandResult Core::on_answer(const fabric::ChannelKey& key, const fabric::CallId& call,
                              const OperatorAnswer& answer) {
  enter();
  CommandResult result = answer_pending(key, call, answer);
  finish();
  return result;
}

CommandResult Core::on_retry(const fabric::ChannelKey& key, const fabric::CallId& call,
                             const std::string& by) {
  enter();
  CommandResult result = retry_pending(key, call, by);
  finish();
  return result;
}

CommandResult Core::answer_pending(const fabric::ChannelKey& key, const fabric::CallId& call,
                                   const OperatorAnswer& answer) {
  const channel::ChannelSession* const there = find(key);
  const fabric::Awaited awaited = there != nullptr && there->call() != nullptr
                                      ? there->call()->awaited
                                      : fabric::Awaited::response_state;
  auto response = Response::of(answer.text, answer.state, awaited);
  if (!response) {
    return {false, "the answer " + response.error() + "; nothing is written"};
  }
  const auto session = find_pending(key, call);
  if (!session) {
    return {false, session.error()};
  }
  (*session)->settle({*std::move(response), answer.by}, now_);
  follow(**session);
  return {true, "the answer is on its way to the program"};
}

CommandResult Core::retry_pending(const fabric::ChannelKey& key, const fabric::CallId& call,
                                  const std::string& by) {
  const auto found = find_pending(key, call);
  if (!found) {
    return {false, found.error()};
  }
  channel::ChannelSession& session = **found;
  // It would run whenever an instance comes, long after somebody has looked at the machine.
  if (const auto unserved = dispatcher_.why_unserved(session.call()->request.uuid, key)) {
    return {false, *unserved + "; start the service, then retry"};
  }
  context_.standing.forget(key);
  session.retry(by, now_);
  follow(session);
  apply(dispatcher_.add(*session.call()));
  return {true, session.status().reason};
}

tl::expected<channel::ChannelSession*, std::string> Core::find_pending(
    const fabric::ChannelKey& key, const fabric::CallId& call) {
  channel::ChannelSession* session = find(key);
  if (session != nullptr && session->status().state == fabric::ChannelState::unserved) {
    return tl::unexpected("the program's request is left alone, so there is no call to act on: " +
                          session->status().reason);
  }
  if (session == nullptr || session->call() == nullptr) {
    return tl::unexpected(std::string("no call is pending on this channel"));
  }
  if (session->call()->id != call) {
    return tl::unexpected("another call is pending by now: " + session->call()->id.to_string());
  }
  if (session->call()->answer) {
    return tl::unexpected(std::string("the call's answer is being written"));
  }
  return session;
}

}  // namespace millrace::gateway::core
