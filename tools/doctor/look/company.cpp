#include <algorithm>
#include <set>
#include <vector>

#include <fmt/format.h>

#include "tools/doctor/look/absence.hpp"
#include "tools/doctor/look/look.hpp"
#include "tools/doctor/look/words.hpp"

namespace millrace::tools::doctor::look {

namespace {

/// The programs of the domain but this one.
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
  std::set<std::string> hosts;
  for (const Program* program : company.ours) {
    hosts.insert(program->host.empty() ? program->addresses : program->host);
  }
  report.fine(fmt::format("on this fabric: {} on {}", counted(company.ours.size(), "other program"),
                          counted(hosts.size(), "host")));
  if (std::ranges::none_of(company.ours, &Program::is_gateway)) {
    report.problem("no gateway is on this fabric, so no controller is asked for calls",
                   "start millrace-gateway with the same fabric and domain" + elsewhere(company));
  }
  if (found.live.instances().empty()) {
    report.problem("no service is on this fabric, so no call can be answered",
                   "start a service with the same fabric and domain" + elsewhere(company));
  }
  for_half_deaf(found, report);
}

}  // namespace millrace::tools::doctor::look
