#include "tools/doctor/diagnose.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <string>

#include <boost/json/array.hpp>

#include "base/messages/catalogue.hpp"
#include "tools/doctor/checks/checks.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::doctor {

namespace messages = base::messages;

std::string_view name_of(Severity severity) {
  constexpr std::array<std::string_view, 3> names{"fine", "warning", "problem"};
  return names.at(static_cast<std::size_t>(severity));
}

bool is_received(const Findings& found, const Program& gateway) {
  return std::ranges::any_of(found.live.machines(), [&](const auto& machine) {
    const fabric::MachineStatus& status = machine.second;
    return !status.gone && status.host == gateway.host && std::to_string(status.pid) == gateway.pid;
  });
}

std::vector<fabric::plant::LostMachine> lost_machines(const Findings& found) {
  std::vector<fabric::plant::LostMachine> all = found.live.lost();
  for (const fabric::plant::LostMachine& lost : found.lost) {
    const bool is_known = std::ranges::any_of(found.live.machines(), [&](const auto& machine) {
      return machine.second.machine == lost.last.machine;
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
    // The log of Cyclone is in lines of its own.
    std::string obstacle = findings.obstacle;
    std::ranges::replace(obstacle, '\n', ';');
    report.problem(messages::fabric_not_joined(obstacle), messages::correct_fabric_configuration());
    return std::move(report).take();
  }
  checks::gateways_and_services(findings, report);
  checks::at_trust(findings, report);
  checks::at_peers(findings, report);
  checks::at_endpoints(findings, report);
  checks::at_machines(findings, report);
  checks::at_concerns(findings, report);
  checks::at_alarms(findings, report);
  checks::at_versions(findings, report);
  checks::at_clocks(findings, report);
  std::vector<Diagnosis> diagnoses = std::move(report).take();
  std::ranges::stable_sort(diagnoses, std::greater(), &Diagnosis::severity);
  return diagnoses;
}

bool is_healthy(const std::vector<Diagnosis>& diagnoses) {
  return std::ranges::none_of(
      diagnoses, [](Severity severity) { return severity == Severity::problem; },
      &Diagnosis::severity);
}

boost::json::object json_of(const Findings& found, const std::vector<Diagnosis>& diagnoses) {
  boost::json::array programs;
  for (const Program& each : found.programs) {
    programs.push_back(boost::json::object{
        {"name", print::utf8(each.name)},
        {"host", print::utf8(each.host)},
        {"pid", print::utf8(each.pid)},
        {"addresses", print::utf8(each.addresses)},
        {"fabrics", boost::json::array(each.fabrics.begin(), each.fabrics.end())},
        {"gateway", each.is_gateway},
        {"heard", !each.is_gateway || is_received(found, each)},
        {"serves", boost::json::array(each.serves.begin(), each.serves.end())},
        {"self", each.self}});
  }
  const auto milliseconds = [](std::chrono::nanoseconds time) {
    return std::chrono::duration<double, std::milli>(time).count();
  };
  boost::json::array clocks;
  for (const HostClock& each : found.clocks) {
    clocks.push_back(boost::json::object{{"host", print::utf8(each.host)},
                                         {"asked", print::utf8(each.program)},
                                         {"ahead_ms", milliseconds(each.difference.ahead)},
                                         {"error_ms", milliseconds(each.difference.error)}});
  }
  boost::json::array answers;
  for (const Diagnosis& each : diagnoses) {
    boost::json::object out{{"severity", name_of(each.severity)}};
    print::put_message(out, "what", each.what);
    out["todo"] = print::json_of(each.todo);
    answers.push_back(std::move(out));
  }
  return {
      {"healthy", is_healthy(diagnoses)},     {"fabric", print::utf8(found.joining.fabric)},
      {"domain", found.joining.domain},       {"interface", print::utf8(found.joining.interface)},
      {"multicast", found.joining.multicast}, {"programs", std::move(programs)},
      {"clocks", std::move(clocks)},          {"diagnoses", std::move(answers)}};
}

}  // namespace millrace::tools::doctor
