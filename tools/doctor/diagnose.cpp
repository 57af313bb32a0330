#include "tools/doctor/diagnose.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "tools/doctor/checks/checks.hpp"

namespace millrace::tools::doctor {

std::string_view name_of(Severity severity) {
  constexpr std::array<std::string_view, 3> names{"fine", "warning", "problem"};
  return names.at(static_cast<std::size_t>(severity));
}

bool is_heard(const Findings& found, const Program& gateway) {
  return std::ranges::any_of(found.live.machines(), [&](const auto& one) {
    const fabric::MachineStatus& status = one.second;
    return !status.gone && status.host == gateway.host && std::to_string(status.pid) == gateway.pid;
  });
}

std::vector<bus::LostMachine> lost_machines(const Findings& found) {
  std::vector<bus::LostMachine> all = found.live.lost();
  for (const bus::LostMachine& lost : found.lost) {
    const bool is_known = std::ranges::any_of(found.live.machines(), [&](const auto& one) {
      return one.second.machine == lost.last.machine;
    });
    if (!is_known) {
      all.push_back(lost);
    }
  }
  return all;
}

std::vector<Diagnosis> diagnose(const Findings& findings) {
  checks::Report report;
  checks::at_the_interface(findings, report);
  if (!findings.obstacle.empty()) {
    report.problem("the fabric cannot be joined: " + findings.obstacle,
                   "correct the configuration (--fabric-config, CYCLONEDDS_URI)");
    return std::move(report).take();
  }
  checks::who_is_there(findings, report);
  checks::at_trust(findings, report);
  checks::at_peers(findings, report);
  checks::at_endpoints(findings, report);
  checks::at_machines(findings, report);
  checks::at_alarms(findings, report);
  checks::at_channels(findings, report);
  checks::at_versions(findings, report);
  checks::at_clocks(findings, report);
  return std::move(report).take();
}

bool is_healthy(const std::vector<Diagnosis>& diagnoses) {
  return std::ranges::none_of(
      diagnoses, [](Severity severity) { return severity == Severity::problem; },
      &Diagnosis::severity);
}

}  // namespace millrace::tools::doctor
