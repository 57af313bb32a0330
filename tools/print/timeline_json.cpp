#include "tools/print/timeline_json.hpp"

#include <boost/json/array.hpp>

#include "tools/print/json.hpp"

namespace millrace::tools::print {

namespace {

boost::json::object json_of(const recording::Step& step) {
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
    out["detail"] = utf8(step.detail);
  }
  return out;
}

}  // namespace

boost::json::object json_of(const recording::Timeline& timeline) {
  boost::json::array steps;
  for (const recording::Step& step : timeline.steps) {
    steps.push_back(json_of(step));
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
