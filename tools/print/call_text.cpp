#include "tools/print/call_text.hpp"

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/words.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::print {

namespace {

using base::text::quoted;
using base::text::safe;

using recording::FollowedCall;

std::string request_of(const FollowedCall& call) {
  return call.request ? fmt::format("{} {}", quoted(*call.request), call.request_state)
                      : std::string("?");
}

std::string end_of(const FollowedCall& call) {
  return call.last == fabric::EventKind::written
             ? fmt::format("{} {}", quoted(call.response), call.response_state)
             : std::string(name_of(call.last));
}

std::string instance_of(const FollowedCall& call) {
  if (!call.instance_name.empty()) {
    return fmt::format("{} on {}", safe(call.instance_name), safe(call.host));
  }
  return call.instance == fabric::InstanceId{} ? "no instance" : call.instance.to_string();
}

std::string what_of(const recording::TimelineStep& step) {
  std::string what;
  if (step.withheld) {
    what = fmt::format("({} bytes, not recorded)", *step.withheld);
  } else if (!step.text.empty() || step.state != 0) {
    what = fmt::format("{} state {}", quoted(step.text), step.state);
  }
  if (!step.detail.empty()) {
    what += (what.empty() ? "" : "  ") + safe(step.detail);
  }
  return what;
}

}  // namespace

std::string line_of(const FollowedCall& call) {
  const auto duration = call.duration();
  std::string line = fmt::format("{}  {}  {}  {} -> {}  {}  {}  {}", clock_text(call.ended),
                                 safe(call.key.to_string()), safe(call.uuid), request_of(call),
                                 end_of(call), duration ? duration_text(*duration) : "-",
                                 instance_of(call), call.id.to_string());
  if (call.attempt > 1) {
    line += fmt::format(" #{}", call.attempt);
  }
  if (call.replayed) {
    line += "  (replayed)";
  }
  return call.detail.empty() ? line : line + "  " + safe(call.detail);
}

boost::json::object json_of(const FollowedCall& call) {
  boost::json::object out{{"call", call.id.to_string()}, {"machine", utf8(call.key.machine)},
                          {"channel", call.key.channel}, {"uuid", utf8(call.uuid)},
                          {"end", name_of(call.last)},   {"attempt", call.attempt}};
  if (call.request) {
    out["request"] = text_json(*call.request);
    out["request_state"] = call.request_state;
  }
  if (call.last == fabric::EventKind::written) {
    out["response"] = text_json(call.response);
    out["response_state"] = call.response_state;
  }
  if (call.instance != fabric::InstanceId{}) {
    out["instance"] = call.instance.to_string();
    out["name"] = utf8(call.instance_name);
    out["host"] = utf8(call.host);
  }
  put_time(out, "seen", call.seen);
  put_time(out, "ended", call.ended);
  if (const auto duration = call.duration()) {
    out["duration_ms"] = std::chrono::duration<double, std::milli>(*duration).count();
  }
  out["detail"] = utf8(call.detail);
  out["replayed"] = call.replayed;
  return out;
}

std::string text_of(const recording::Timeline& timeline) {
  std::string text = fmt::format("call {} of {}, service {}{}\n\n", timeline.call.to_string(),
                                 safe(timeline.key.to_string()), safe(timeline.uuid),
                                 timeline.replayed ? ", replayed" : "");
  Table table({{"TIME"}, {"AFTER", Align::right}, {"ATTEMPT", Align::right}, {"HOP"}, {"WHAT"}});
  const fabric::Time start = timeline.steps.front().at;
  if (timeline.steps.front().stage == recording::Stage::seen) {
    table.add({"", "", "", "written by the program", "up to one poll earlier; not timestamped"});
  }
  for (const recording::TimelineStep& step : timeline.steps) {
    table.add({clock_text(step.at), duration_text(step.at - start),
               step.attempt == 0 ? "" : std::to_string(step.attempt),
               std::string(name_of(step.stage)) + (step.by_service ? " *" : ""), what_of(step)});
  }
  text += table.text() + "\n* by the clock of the service's host";
  if (timeline.clock_difference != std::chrono::nanoseconds{}) {
    text += fmt::format(", which differs by at least {}", duration_text(timeline.clock_difference));
  }
  return text + '\n';
}

}  // namespace millrace::tools::print
