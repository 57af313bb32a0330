#include "tools/replay/matcher.hpp"

#include <fmt/format.h>

#include "base/text/quoted.hpp"

namespace millrace::tools::replay {

namespace {

Mismatch mismatch(const fabric::Request& request, const std::string& text, std::string reason) {
  Mismatch found{.reason = std::move(reason), .text = text};
  found.reason +=
      fmt::format("; the request was {} state {} of {} to {}", base::text::quoted(request.text),
                  request.state, request.key.to_string(), base::text::safe(request.uuid));
  // `reason` has the complete text.
  if (found.text.size() > fabric::max_text) {
    found.text.resize(fabric::max_text - 3);
    found.text += "...";
  }
  return found;
}

}  // namespace

Matcher::Matcher(const Plan& plan, const std::map<fabric::ChannelKey, fabric::ChannelKey>& channels,
                 std::size_t rounds)
    : plan_(plan), rounds_(rounds) {
  for (std::size_t i = 0; i < plan.calls.size(); ++i) {
    channels_[channels.at(plan.calls[i].channel)].calls.push_back(i);
  }
}

Match Matcher::on_request(const fabric::Request& request) {
  const auto found = channels_.find(request.key);
  if (found == channels_.end()) {
    return mismatch(request, "ERROR: replay: no call of this channel is recorded",
                    fmt::format("no call of {} is recorded", request.key.to_string()));
  }
  ChannelCalls& channel_calls = found->second;
  if (channel_calls.last == request.call) {
    Match again = channel_calls.match;
    std::visit([](auto& what) { what.repeated = true; }, again);
    return again;
  }
  channel_calls.last = request.call;
  channel_calls.match = match(channel_calls, request);
  return channel_calls.match;
}

Match Matcher::match(ChannelCalls& channel_calls, const fabric::Request& request) {
  if (is_over(channel_calls)) {
    return mismatch(request, "ERROR: replay: the recording has no more calls of this channel",
                    fmt::format("the recording has no more calls of {} after these {}",
                                request.key.to_string(), channel_calls.calls.size()));
  }
  const std::size_t index = channel_calls.calls[channel_calls.next];
  const PlannedCall& expected = plan_.calls[index];
  const std::string number =
      fmt::format("{} of {}", channel_calls.next + 1, channel_calls.calls.size());
  const std::string expectation =
      fmt::format("expected next is call {} of this channel, {}: {} state {} to {}", number,
                  expected.recorded.to_string(), base::text::quoted(expected.text), expected.state,
                  base::text::safe(expected.uuid));
  const auto answer = expected.answer
                          ? fmt::format(", which was answered {} state {}",
                                        base::text::quoted(expected.answer->answer.text),
                                        expected.answer->answer.state)
                          : std::string(", which no service answered");
  if (fabric::canonical_uuid(request.uuid) != fabric::canonical_uuid(expected.uuid)) {
    return mismatch(request, fmt::format("ERROR: replay: call {} is for {}", number, expected.uuid),
                    "the service differs; " + expectation + answer);
  }
  if (request.text != expected.text) {
    return mismatch(request,
                    fmt::format("ERROR: replay: call {} asks \"{}\"", number, expected.text),
                    "the text differs; " + expectation + answer);
  }
  if (request.state != expected.state) {
    return mismatch(request,
                    fmt::format("ERROR: replay: call {} has state {}", number, expected.state),
                    "the state differs; " + expectation + answer);
  }
  if (++channel_calls.next == channel_calls.calls.size()) {
    ++channel_calls.rounds_done;
    channel_calls.next = is_over(channel_calls) ? channel_calls.next : 0;
  }
  return Matched{.call = index};
}

bool Matcher::complete() const {
  return rounds_ != 0 && missing() == 0;
}

std::size_t Matcher::missing() const {
  std::size_t missing = 0;
  for (const auto& [key, channel_calls] : channels_) {
    if (rounds_ == 0) {
      missing +=
          channel_calls.rounds_done > 0 ? 0 : channel_calls.calls.size() - channel_calls.next;
    } else if (!is_over(channel_calls)) {
      missing +=
          channel_calls.calls.size() * (rounds_ - channel_calls.rounds_done) - channel_calls.next;
    }
  }
  return missing;
}

}  // namespace millrace::tools::replay
