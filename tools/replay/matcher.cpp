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
  // The operator's text has all of it.
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
    lanes_[channels.at(plan.calls[i].channel)].calls.push_back(i);
  }
}

Match Matcher::on_request(const fabric::Request& request) {
  const auto found = lanes_.find(request.key);
  if (found == lanes_.end()) {
    return mismatch(request, "ERROR: replay: no call of this channel is recorded",
                    fmt::format("no call of {} is recorded", request.key.to_string()));
  }
  Lane& lane = found->second;
  if (lane.last == request.call) {
    Match again = lane.match;
    std::visit([](auto& what) { what.repeated = true; }, again);
    return again;
  }
  lane.last = request.call;
  lane.match = match(lane, request);
  return lane.match;
}

Match Matcher::match(Lane& lane, const fabric::Request& request) {
  if (is_over(lane)) {
    return mismatch(request, "ERROR: replay: the recording has no more calls of this channel",
                    fmt::format("the recording has no more calls of {} after these {}",
                                request.key.to_string(), lane.calls.size()));
  }
  const std::size_t index = lane.calls[lane.next];
  const PlannedCall& expected = plan_.calls[index];
  const std::string number = fmt::format("{} of {}", lane.next + 1, lane.calls.size());
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
  if (++lane.next == lane.calls.size()) {
    ++lane.rounds_done;
    lane.next = is_over(lane) ? lane.next : 0;
  }
  return Matched{.call = index};
}

bool Matcher::complete() const {
  return rounds_ != 0 && missing() == 0;
}

std::size_t Matcher::missing() const {
  std::size_t missing = 0;
  for (const auto& [key, lane] : lanes_) {
    if (rounds_ == 0) {
      missing += lane.rounds_done > 0 ? 0 : lane.calls.size() - lane.next;
    } else if (!is_over(lane)) {
      missing += lane.calls.size() * (rounds_ - lane.rounds_done) - lane.next;
    }
  }
  return missing;
}

}  // namespace millrace::tools::replay
