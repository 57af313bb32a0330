#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/checks/checks.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

}  // namespace

void at_endpoints(const Findings& found, Report& report) {
  for (const Misfit& misfit : found.misfits) {
    for (const std::string& reason : misfit.reasons) {
      report.problem(
          fmt::format("the {} of {} of {} matches no millrace process: {}",
                      misfit.writer ? "writer" : "reader", misfit.topic, safe(misfit.program),
                      safe(reason)),
          "give it the QoS and types of docs/reference/wire.md and idl/millrace.idl, or the "
          "same version of millrace");
    }
  }
  for (const std::string& each : found.ignored) {
    report.problem(safe(each), "start a millrace service of this version");
  }
}

}  // namespace millrace::tools::doctor::checks
