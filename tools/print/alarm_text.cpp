#include "tools/print/alarm_text.hpp"

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::print {

using base::text::safe;

std::string said_by(const fabric::Alarm& alarm) {
  return fmt::format("{} on {}, pid {}", alarm.program.empty() ? "a program" : safe(alarm.program),
                     safe(alarm.host), alarm.pid);
}

std::string what_is_said(const fabric::Alarm& alarm) {
  return fmt::format("{}: {}", said_by(alarm), safe(alarm.text));
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
