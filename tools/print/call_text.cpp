#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "fabric/words.hpp"
#include "tools/print/entry_text.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::print {

namespace {

using base::text::safe;

using recording::Call;
using recording::Stage;
using recording::Step;
using Name = recording::InstanceNames::Name;

std::string text_of(const Step* step) {
  return step == nullptr ? std::string("?")
                         : fmt::format("{} {}", base::text::quoted(step->text), step->state);
}

std::string response_of(const Call& call) {
  const Step* const end = call.end();
  return end != nullptr && end->stage == Stage::written ? text_of(end) : std::string(end_of(call));
}

std::string instance_of(const Call& call, const Name& name) {
  if (!name.name.empty()) {
    return fmt::format("{} on {}", safe(name.name), safe(name.host));
  }
  const fabric::InstanceId instance = call.instance();
  return instance == fabric::InstanceId{} ? "no instance" : instance.to_string();
}

std::string what_of(const Step& step) {
  std::string what;
  if (step.withheld) {
    what = fmt::format("({} bytes, not recorded)", *step.withheld);
  } else if (!step.text.empty() || step.state != 0) {
    what = fmt::format("{} state {}", base::text::quoted(step.text), step.state);
  }
  if (!step.detail.empty()) {
    what += (what.empty() ? "" : "  ") + safe(step.detail);
  }
  return what;
}

}  // namespace

std::string_view end_of(const Call& call) {
  const Step* const end = call.end();
  return end == nullptr ? std::string_view() : event_name_of(end->stage);
}

std::string line_of(const Call& call, const Name& name) {
  const auto duration = call.duration();
  const Step end = call.end() == nullptr ? Step{} : *call.end();
  std::string line = fmt::format(
      "{}  {}  {}  {} -> {}  {}  {}  {}", clock_text(end.at), safe(call.key.to_string()),
      safe(call.uuid), text_of(call.first(Stage::seen)), response_of(call),
      duration ? duration_text(*duration) : "-", instance_of(call, name), call.id.to_string());
  if (call.attempt() > 1) {
    line += fmt::format(" #{}", call.attempt());
  }
  if (call.replayed) {
    line += "  (replayed)";
  }
  return end.detail.empty() ? line : line + "  " + safe(end.detail);
}

boost::json::object json_of(const Call& call, const Name& name) {
  boost::json::object out{{"call", call.id.to_string()}, {"machine", utf8(call.key.machine)},
                          {"channel", call.key.channel}, {"uuid", utf8(call.uuid)},
                          {"end", end_of(call)},         {"attempt", call.attempt()}};
  const Step* const seen = call.first(Stage::seen);
  if (seen != nullptr) {
    out["request"] = text_json(seen->text);
    out["request_state"] = seen->state;
  }
  const Step end = call.end() == nullptr ? Step{} : *call.end();
  if (end.stage == Stage::written) {
    out["response"] = text_json(end.text);
    out["response_state"] = end.state;
  }
  if (const fabric::InstanceId instance = call.instance(); instance != fabric::InstanceId{}) {
    out["instance"] = instance.to_string();
    out["name"] = utf8(name.name);
    out["host"] = utf8(name.host);
  }
  put_time(out, "seen", seen == nullptr ? fabric::Time{} : seen->at);
  put_time(out, "ended", end.at);
  if (const auto duration = call.duration()) {
    out["duration_ms"] = std::chrono::duration<double, std::milli>(*duration).count();
  }
  put_message(out, "detail", end.detail);
  out["replayed"] = call.replayed;
  return out;
}

std::string text_of(const recording::Timeline& timeline) {
  std::string text = fmt::format("call {} of {}, service {}{}\n\n", timeline.call.to_string(),
                                 safe(timeline.key.to_string()), safe(timeline.uuid),
                                 timeline.replayed ? ", replayed" : "");
  Table table({{"TIME"}, {"AFTER", Align::right}, {"ATTEMPT", Align::right}, {"HOP"}, {"WHAT"}});
  // None, if only a later version knows what happened.
  const Step first = timeline.steps.empty() ? Step{.stage = Stage::late} : timeline.steps.front();
  const fabric::Time start = first.at;
  if (first.stage == Stage::seen) {
    table.add({"", "", "", "written by the NC program", "up to one poll earlier; not timestamped"});
  }
  for (const Step& step : timeline.steps) {
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

namespace {

boost::json::object step_json(const recording::Step& step) {
  boost::json::object out;
  put_time(out, "time", step.at);
  out["hop"] = name_of(step.stage);
  out["attempt"] = step.attempt;
  out["by_service"] = step.by_service;
  if (step.instance != fabric::InstanceId{}) {
    out["instance"] = step.instance.to_string();
  }
  if (step.withheld) {
    out["text_size"] = *step.withheld;
  } else if (!step.text.empty() || step.state != 0) {
    out["text"] = text_json(step.text);
    out["state"] = step.state;
  }
  if (!step.detail.empty()) {
    put_message(out, "detail", step.detail);
  }
  return out;
}

}  // namespace

boost::json::object json_of(const recording::Timeline& timeline) {
  boost::json::array steps;
  for (const recording::Step& step : timeline.steps) {
    steps.push_back(step_json(step));
  }
  return {{"call", timeline.call.to_string()},
          {"machine", utf8(timeline.key.machine)},
          {"channel", timeline.key.channel},
          {"uuid", utf8(timeline.uuid)},
          {"replayed", timeline.replayed},
          {"clock_difference_ms",
           std::chrono::duration<double, std::milli>(timeline.clock_difference).count()},
          {"steps", std::move(steps)}};
}

}  // namespace millrace::tools::print
