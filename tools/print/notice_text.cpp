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
  boost::json::object out;
  put_fields(out, notice);
  // In an entry "kind" is what the entry is.
  out["kind"] = utf8(notice.key.kind);
  out.erase("notice");
  return out;
}

}  // namespace millrace::tools::print
