#include "tools/print/data.hpp"

#include <array>
#include <cmath>

#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/print/json.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::print {

namespace {

using base::text::safe;
using fabric::Value;
using fabric::ValueType;

std::string element_text(ValueType type, std::int64_t element) {
  if (type == ValueType::boolean) {
    return element != 0 ? "TRUE" : "FALSE";
  }
  return std::to_string(element);
}
std::string element_text(ValueType, double element) {
  return fmt::format("{}", element);
}
std::string element_text(ValueType, const std::string& element) {
  return base::text::quoted(element);
}

boost::json::value element_json(ValueType type, std::int64_t element) {
  if (type == ValueType::boolean) {
    return element != 0;
  }
  return element;
}
/// JSON has no word for what is not a number.
boost::json::value element_json(ValueType, double element) {
  return std::isfinite(element) ? boost::json::value(element)
                                : boost::json::value(fmt::format("{}", element));
}
boost::json::value element_json(ValueType, const std::string& element) {
  return boost::json::string(text_json(element));
}

std::chrono::nanoseconds duration_of(const fabric::ProgramEvent& event) {
  return event.started == fabric::Time{} ? std::chrono::nanoseconds::zero()
                                         : event.at - event.started;
}

}  // namespace

std::string text_of(const Value& value) {
  std::string text;
  std::visit(
      [&](const auto& elements) {
        for (const auto& element : elements) {
          text += (text.empty() ? "" : ", ") + element_text(value.type, element);
        }
      },
      value.elements);
  if (value.is_array) {
    return "[" + text + "]";
  }
  return fabric::count(value.elements) == 0 ? "-" : text;
}

boost::json::value json_of_elements(const Value& value) {
  boost::json::array values;
  std::visit(
      [&](const auto& elements) {
        for (const auto& element : elements) {
          values.push_back(element_json(value.type, element));
        }
      },
      value.elements);
  if (value.is_array) {
    return values;
  }
  return values.empty() ? boost::json::value(nullptr) : values.front();
}

boost::json::object json_of(const Value& value) {
  boost::json::object out{{"name", utf8(value.name)},
                          {"type", fabric::name_of(value.type)},
                          {"quality", fabric::name_of(value.quality)},
                          {"value", json_of_elements(value)}};
  put_time(out, "at", value.at);
  if (!value.reason.empty()) {
    out["reason"] = utf8(value.reason);
  }
  return out;
}

void put_program(boost::json::object& out, const fabric::ProgramEvent& event) {
  put_fields(out, event);
  if (event.started != fabric::Time{}) {
    out["duration_s"] = std::chrono::duration<double>(duration_of(event)).count();
  }
  if (event.mode != 0) {
    out["mode"] = mode_text(event.mode);
  }
}

std::string mode_text(std::uint32_t mode) {
  constexpr std::array<std::string_view, 6> names{"-",   "standby", "automatic",
                                                  "MDI", "manual",  "reference"};
  return mode < names.size() ? std::string(names.at(mode)) : fmt::format("mode {}", mode);
}

std::string line_of(const fabric::ProgramEvent& event) {
  std::string line(fabric::name_of(event.kind));
  if (!event.program.empty()) {
    line += "  " + base::text::quoted(event.program);
  }
  if (event.error != 0) {
    line += fmt::format("  error {}", event.error);
  }
  if (event.kind != fabric::ProgramEventKind::started && event.started != fabric::Time{}) {
    line += "  after " + duration_text(duration_of(event));
  }
  if (event.parts) {
    line += fmt::format("  {} parts", *event.parts);
  }
  if (event.mode != 0) {
    line += "  " + mode_text(event.mode);
  }
  if (!event.detail.empty()) {
    line += "  " + safe(event.detail);
  }
  return event.replayed ? line + "  (replayed)" : line;
}

std::string line_of(const fabric::DataSample& sample) {
  std::string line = safe(sample.group);
  if (sample.values.empty()) {
    return line + "  not published any more";
  }
  for (const Value& value : sample.values) {
    line += fmt::format("  {}={}", safe(value.name), text_of(value));
    if (value.quality != fabric::Quality::good) {
      line += fmt::format(" ({}: {})", fabric::name_of(value.quality), safe(value.reason));
    }
  }
  return sample.replayed ? line + "  (replayed)" : line;
}

std::string reported_by(const fabric::Alarm& alarm) {
  return fmt::format("{} on {}, pid {}", alarm.program.empty() ? "a process" : safe(alarm.program),
                     safe(alarm.host), alarm.pid);
}

std::string reported_problems(const fabric::Alarm& alarm) {
  return fmt::format("{}: {}", reported_by(alarm), safe(alarm.text));
}

boost::json::object json_of(const fabric::Alarm& alarm) {
  boost::json::object out;
  put_fields(out, alarm);
  // In an entry "kind" is what the entry is.
  out["kind"] = utf8(alarm.key.kind);
  out.erase("alarm");
  return out;
}

}  // namespace millrace::tools::print
