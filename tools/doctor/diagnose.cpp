#include "tools/doctor/diagnose.hpp"

#include <algorithm>
#include <array>

#include "tools/doctor/look/look.hpp"

namespace millrace::tools::doctor {

std::string_view name_of(Severity severity) {
  constexpr std::array<std::string_view, 3> names{"fine", "warning", "problem"};
  return names.at(static_cast<std::size_t>(severity));
}

std::vector<Diagnosis> diagnose(const Findings& findings) {
  look::Report report;
  look::at_the_interface(findings, report);
  if (!findings.obstacle.empty()) {
    report.problem("the fabric cannot be joined: " + findings.obstacle,
                   "put the configuration right (--fabric-config, CYCLONEDDS_URI)");
    return std::move(report).take();
  }
  look::who_is_there(findings, report);
  look::at_trust(findings, report);
  look::at_peers(findings, report);
  look::at_endpoints(findings, report);
  look::at_machines(findings, report);
  look::at_channels(findings, report);
  look::at_notices(findings, report);
  look::at_versions(findings, report);
  look::at_clocks(findings, report);
  return std::move(report).take();
}

bool is_healthy(const std::vector<Diagnosis>& diagnoses) {
  return std::ranges::none_of(
      diagnoses, [](Severity severity) { return severity == Severity::problem; },
      &Diagnosis::severity);
}

}  // namespace millrace::tools::doctor
