#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/checks/absence.hpp"
#include "tools/doctor/checks/checks.hpp"
#include "tools/doctor/checks/words.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

/// The other processes of the domain.
struct Company {
  /// On this fabric.
  std::vector<const Program*> ours;
  std::set<std::string> other_fabrics;
};

Company company_of(const Findings& found) {
  Company company;
  for (const Program& program : found.programs) {
    if (program.self) {
      continue;
    }
    if (program.fabrics.contains(found.joining.fabric)) {
      company.ours.push_back(&program);
    } else {
      company.other_fabrics.insert(program.fabrics.begin(), program.fabrics.end());
    }
  }
  return company;
}

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

/// "10.77.0.1" of "udp/10.77.0.1:7410@2"; empty if there is none.
std::string ip_of(const std::string& addresses) {
  const std::size_t begin = addresses.find('/');
  const std::size_t end = addresses.find(':', begin);
  return begin == std::string::npos || end == std::string::npos
             ? std::string()
             : addresses.substr(begin + 1, end - begin - 1);
}

/// By name, or by address where another vendor's process has no name.
std::set<std::string> hosts_of(const Company& company) {
  std::set<std::string> hosts;
  std::set<std::string> known;
  for (const Program* program : company.ours) {
    if (!program->host.empty()) {
      hosts.insert(program->host);
      known.insert(ip_of(program->addresses));
    }
  }
  for (const Program* program : company.ours) {
    const std::string ip = ip_of(program->addresses);
    if (program->host.empty() && !ip.empty() && !known.contains(ip)) {
      hosts.insert(ip);
    }
  }
  if (hosts.empty()) {
    hosts.insert("");
  }
  return hosts;
}

/// Participants that exist but send nothing.
void for_the_silent(const Findings& found, const Company& company, Report& report) {
  const std::vector<bus::LostMachine> all_lost = lost_machines(found);
  for (const Program* program : company.ours) {
    const bool is_told = std::ranges::any_of(all_lost, [&](const bus::LostMachine& lost) {
      return lost.last.host == program->host && std::to_string(lost.last.pid) == program->pid;
    });
    if (program->is_gateway && !is_told && !is_heard(found, *program)) {
      report.problem(
          fmt::format("the gateway on {}, pid {}, does not report: it was killed, is frozen, or "
                      "cannot be reached",
                      safe(program->host), safe(program->pid)),
          fmt::format("restart the gateway on {}; pending calls wait and are not lost",
                      safe(program->host)));
    }
  }
  for (const auto& [id, gone] : found.live.gone()) {
    const fabric::InstanceIdentity& identity = gone.last.identity;
    report.warning(
        fmt::format("{} {} on {}, pid {}, sends no heartbeat: it is frozen or has ended",
                    safe(identity.name), id.to_string(), safe(identity.host), identity.pid),
        fmt::format("restart it on {}", safe(identity.host)));
  }
}

std::string elsewhere(const Company& company) {
  return company.other_fabrics.empty()
             ? ""
             : fmt::format("; this domain also has the fabrics {}", list_of(company.other_fabrics));
}

}  // namespace

void who_is_there(const Findings& found, Report& report) {
  const Company company = company_of(found);
  if (company.ours.empty()) {
    for_the_others(found, company.other_fabrics, report);
    return;
  }
  report.fine(fmt::format("on this fabric: {} on {}", counted(company.ours.size(), "other program"),
                          counted(hosts_of(company).size(), "host")));
  for_the_silent(found, company, report);
  if (std::ranges::none_of(company.ours, [&](const Program* program) {
        return program->is_gateway && is_heard(found, *program);
      })) {
    report.problem("no gateway is on this fabric, so no controller is polled for calls",
                   "start millrace-gateway with the same fabric and domain" + elsewhere(company));
  }
  if (found.live.instances().empty()) {
    report.problem("no service is on this fabric, so no call can be answered",
                   "start a service with the same fabric and domain" + elsewhere(company));
  }
  for_half_deaf(found, report);
}

}  // namespace millrace::tools::doctor::checks
