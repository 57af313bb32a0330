// Commands of an operator for a channel's call.
#include <utility>

#include "base/messages/catalogue.hpp"
#include "gateway/core/core.hpp"

namespace millrace::gateway::core {

CommandResult Core::on_answer(const fabric::ChannelKey& key, const fabric::CallId& call,
                              const OperatorAnswer& answer) {
  return input([&]() -> CommandResult {
    const channel::Channel* const there = channels_.find(key);
    const fabric::CompletionSignal completion_signal =
        there != nullptr && there->call() != nullptr ? there->call()->completion_signal
                                                     : fabric::CompletionSignal::response_state;
    auto response = Response::of(answer.text, answer.state, completion_signal);
    if (!response) {
      return {false, base::messages::operator_answer_refused(response.error())};
    }
    const auto channel = find_pending(key, call);
    if (!channel) {
      return {false, channel.error()};
    }
    change_call(**channel, [&](channel::OpenCall& open, channel::ChannelOutput& out) {
      open.answer_locally({*std::move(response), answer.by}, out, now_);
    });
    return {true, base::messages::operator_answer_accepted()};
  });
}

CommandResult Core::on_retry(const fabric::ChannelKey& key, const fabric::CallId& call,
                             const std::string& by) {
  return input([&]() -> CommandResult {
    const auto found = find_pending(key, call);
    if (!found) {
      return {false, found.error()};
    }
    channel::Channel& channel = **found;
    // It would run whenever an instance starts, long after the operator has looked at the machine.
    if (const auto unserved = dispatcher_.why_unserved(channel.call()->request.uuid, key)) {
      return {false, base::messages::start_then_retry(*unserved)};
    }
    context_.blocked.forget(key);
    change_call(channel,
                [&](channel::OpenCall& open, channel::ChannelOutput& out) { open.retry(by, out); });
    apply(dispatcher_.add(channel.call()));
    return {true, channel.status().reason};
  });
}

tl::expected<channel::Channel*, fabric::Message> Core::find_pending(const fabric::ChannelKey& key,
                                                                    const fabric::CallId& call) {
  channel::Channel* channel = channels_.find(key);
  if (channel != nullptr && channel->status().state == fabric::ChannelState::unserved) {
    return tl::unexpected(base::messages::request_not_accepted(channel->status().reason));
  }
  if (channel == nullptr || channel->call() == nullptr) {
    return tl::unexpected(base::messages::no_call_pending());
  }
  if (channel->call()->id != call) {
    return tl::unexpected(base::messages::another_call(channel->call()->id.to_string()));
  }
  if (channel->call()->answer) {
    return tl::unexpected(base::messages::response_under_way());
  }
  return channel;
}

}  // namespace millrace::gateway::core
