// The calls of LCM processes, and the messages to them.
#include <algorithm>

#include <fmt/format.h>
#include <millrace/request_t.hpp>
#include <millrace/withdrawal_t.hpp>

#include "base/text/quoted.hpp"
#include "fabric/lcm/message.hpp"
#include "services/lcm/bridge.hpp"
#include "services/lcm/received.hpp"

namespace millrace::services::lcm {

namespace {

using fabric::CallId;
using fabric::SteadyTime;

call_t call_of(const fabric::Request& request) {
  call_t call;
  call.id = call_name(request);
  call.attempt = static_cast<std::int32_t>(request.attempt);
  return call;
}

Publish withdrawal_of(const std::string& uuid, std::int64_t program,
                      const fabric::Request& request) {
  withdrawal_t message;
  message.program = program;
  message.call = call_of(request);
  return {channel_of(withdrawal_prefix, uuid), fabric::lcm::encode(message)};
}

/// The state of a reply as the controller's type, or why it does not fit.
tl::expected<std::uint32_t, std::string> state_of(std::int64_t state) {
  if (state < 0 || state > 0xFFFF'FFFF) {
    return tl::unexpected(
        fmt::format("the program answered with state {}, which does not fit 32 bits", state));
  }
  return static_cast<std::uint32_t>(state);
}

sdk::Result result_of(const Answered& answered, Encoding encoding) {
  auto text = to_controller(answered.text, encoding);
  if (answered.kind == AnswerKind::failed) {
    return tl::unexpected(text ? *std::move(text) : base::text::safe(answered.text));
  }
  if (!text) {
    return tl::unexpected("the program's answer: " + text.error());
  }
  return state_of(answered.state).map([&](std::uint32_t state) {
    return sdk::Response{.text = *std::move(text), .state = state};
  });
}

/// Why the result is not a valid interim response; empty if it is.
std::string why_unfit(const sdk::Result& result) {
  if (!result) {
    return result.error();
  }
  if (result->text.size() > fabric::max_text) {
    return fmt::format("it has {} bytes, at most {} fit", result->text.size(), fabric::max_text);
  }
  return result->text.find('\0') == std::string::npos ? "" : "it contains a NUL byte";
}

}  // namespace

void Bridge::compare_calls(Program& program, const Key& key, const Presence& presence,
                           SteadyTime now, Actions& actions) {
  std::vector<std::string> over;
  for (auto& [name, given] : program.calls) {
    if (now - given.sent < settle) {
      continue;
    }
    const bool shown = std::ranges::any_of(
        presence.calls, [&](const Attempt& attempt) { return attempt.call == name; });
    if (!given.withdrawn && !shown) {
      given.sent = now;
      actions.emplace_back(request_for(key, given));
    } else if (given.withdrawn && shown) {
      given.sent = now;
      actions.emplace_back(withdrawal_of(key.first, key.second, given.request));
    } else if (given.withdrawn) {
      over.push_back(name);
    }
  }
  for (const std::string& name : over) {
    // The result of a cancelled call is not sent.
    end(program, name, sdk::Response{.text = "withdrawn"}, actions);
  }
}

void Bridge::on_reply(std::string_view uuid, const Answered& answered, Sender sender,
                      SteadyTime now, Actions& actions) {
  const auto place = programs_.find(Key{fabric::canonical_uuid(uuid), answered.program});
  const std::string& call = answered.attempt.call;
  if (place == programs_.end()) {
    warn_limited(
        "unknown", uuid,
        fmt::format("{} of {} at {} answers call {}, but has not announced itself; ignored",
                    program_name(answered.program), base::text::safe(uuid), sender.to_string(),
                    call),
        now, actions);
    return;
  }
  auto& [key, program] = *place;
  if (program.sender != sender) {
    warn_limited(
        "forged", uuid,
        fmt::format(
            "an answer to call {} comes from {} with the number of {}, which is at {}; ignored",
            call, sender.to_string(), program_name(answered.program), program.sender.to_string()),
        now, actions);
    return;
  }
  const auto given = program.calls.find(answered.attempt.call);
  if (given != program.calls.end() && answered.attempt.number <= given->second.request.attempt) {
    take_answer(program, given->second, answered, key, now, actions);
    return;
  }
  const std::uint32_t* const over = program.over.find(answered.attempt.call);
  if (over == nullptr || answered.attempt.number > *over) {
    warn_limited(
        "stray", uuid,
        fmt::format(
            "{} of {} at {} answers attempt {} of call {}, which was not dispatched to it; ignored",
            program_name(answered.program), uuid, sender.to_string(), answered.attempt.number,
            call),
        now, actions);
  }
}

void Bridge::take_answer(Program& program, Given& given, const Answered& answered, const Key& key,
                         SteadyTime now, Actions& actions) {
  const std::string& name = answered.attempt.call;
  const std::uint32_t* const withdrawn = program.withdrawn.find(name);
  if (!given.withdrawn && withdrawn != nullptr && answered.attempt.number <= *withdrawn) {
    // A reply to the cancelled attempt; the current one continues.
    return;
  }
  if (answered.kind == AnswerKind::interim) {
    take_interim(program, given, answered, key, now, actions);
    return;
  }
  end(program, name, result_of(answered, encoding_of(key.first)), actions);
}

void Bridge::take_interim(Program& program, Given& given, const Answered& answered, const Key& key,
                          SteadyTime now, Actions& actions) {
  sdk::Result result = result_of(answered, encoding_of(key.first));
  if (const std::string why = why_unfit(result); !why.empty()) {
    warn_limited("interim", key.first,
                 fmt::format("an interim answer of {} to call {} is dropped: {}",
                             program_name(answered.program), given.request.call.to_string(), why),
                 now, actions);
    return;
  }
  given.interim = *std::move(result);
  flush_interim(program, given, now, actions);
}

void Bridge::flush_interim(const Program& program, Given& given, SteadyTime now, Actions& actions) {
  if (given.interim && now - given.interim_sent >= interim_pause) {
    given.interim_sent = now;
    actions.emplace_back(
        Progress{*program.registration, given.request.call, *std::move(given.interim)});
    given.interim.reset();
  }
}

void Bridge::end(Program& program, const std::string& name, sdk::Result result, Actions& actions) {
  const auto place = program.calls.find(name);
  const CallId call = place->second.request.call;
  program.over.put(0, name, place->second.request.attempt);
  program.calls.erase(place);
  actions.emplace_back(Answer{*program.registration, call, std::move(result)});
}

Actions Bridge::on_call(Registration number, const fabric::Request& request, SteadyTime now) {
  const auto [key, program] = find(number);
  if (program == nullptr) {
    return {};
  }
  Given& given = program->calls[call_name(request)];
  given = {.request = request, .sent = now};
  return {request_for(*key, given)};
}

Actions Bridge::on_cancelled(Registration number, CallId call, SteadyTime now) {
  const auto [key, program] = find(number);
  if (program == nullptr) {
    return {};
  }
  const auto given = std::ranges::find_if(
      program->calls, [&](const auto& pending) { return pending.second.request.call == call; });
  if (given == program->calls.end() || given->second.withdrawn) {
    return {};
  }
  given->second.withdrawn = true;
  given->second.sent = now;
  given->second.interim.reset();
  program->withdrawn.put(0, given->first, given->second.request.attempt);
  return {withdrawal_of(key->first, key->second, given->second.request)};
}

Encoding Bridge::encoding_of(const std::string& uuid) const {
  const ServiceRule* const rule = rules_.find(uuid);
  return rule == nullptr ? Encoding::utf8 : rule->encoding;
}

Publish Bridge::request_for(const Key& key, const Given& given) const {
  using std::chrono::microseconds;
  const fabric::Request& request = given.request;
  const Encoding encoding = encoding_of(key.first);
  request_t message;
  message.program = key.second;
  message.call = call_of(request);
  message.machine = request.key.machine;
  message.channel = request.key.channel;
  message.uuid = from_controller(request.uuid, encoding);
  message.text = from_controller(request.text, encoding);
  message.state = request.state;
  message.deadline =
      std::chrono::duration_cast<microseconds>(request.deadline.time_since_epoch()).count();
  message.replayed = request.replayed ? 1 : 0;
  return {channel_of(request_prefix, key.first), fabric::lcm::encode(message)};
}

}  // namespace millrace::services::lcm
