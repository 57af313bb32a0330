#include "tools/print/notice_text.hpp"

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::print {

using base::text::safe;

std::string said_by(const fabric::Notice& notice) {
  return fmt::format("{} on {}, pid {}",
                     notice.program.empty() ? "a program" : safe(notice.program), safe(notice.host),
                     notice.pid);
}

std::string what_is_said(const fabric::Notice& notice) {
  return fmt::format("{}: {}", said_by(notice), safe(notice.text));
}

boost::json::object json_of(const fabric::Notice& notice) {
  boost::json::object out{{"level", name_of(notice.level)},
                          {"kind", utf8(notice.key.kind)},
                          {"subject", utf8(notice.key.subject)},
                          {"text", utf8(notice.text)},
                          {"advice", utf8(notice.advice)}};
  put_time(out, "since", notice.since);
  out["program"] = utf8(notice.program);
  out["host"] = utf8(notice.host);
  out["pid"] = notice.pid;
  out["responder"] = notice.key.responder.to_string();
  return out;
}

}  // namespace millrace::tools::print
