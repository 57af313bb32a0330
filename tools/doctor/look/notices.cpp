#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/look/look.hpp"
#include "tools/print/notice_text.hpp"

namespace millrace::tools::doctor::look {

void at_notices(const Findings& found, Report& report) {
  for (const auto& [key, notice] : found.live.notices()) {
    const std::string what = print::what_is_said(notice);
    const std::string advice = base::text::safe(notice.advice);
    switch (notice.level) {
      case fabric::NoticeLevel::fine:
        report.fine(what);
        break;
      case fabric::NoticeLevel::warning:
        report.warning(what, advice);
        break;
      default:
        // Whatever a newer program means by it.
        report.problem(what, advice);
        break;
    }
  }
  if (found.live.too_many_notices()) {
    report.warning(fmt::format("programs say more of themselves than the {} things that are kept",
                               bus::Live::most_notices),
                   "look whose they are; somebody may flood millrace/notice");
  }
}

}  // namespace millrace::tools::doctor::look
