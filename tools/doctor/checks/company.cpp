#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/checks/checks.hpp"

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

/// "10.77.0.1" of "udp/10.77.0.1:7410"; empty if there is none.
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
          fmt::format("restart the gateway on {}", safe(program->host)));
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

void gateways_and_services(const Findings& found, Report& report) {
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

namespace {

void at_other_domains(const Findings& found, Report& report) {
  std::map<std::uint32_t, std::set<std::string>> heard;
  for (const ReceivedAnnouncement& each : found.heard) {
    if (each.domain != found.joining.domain) {
      heard[each.domain].insert(fmt::format("{} ({})", program_text(each.who), each.from));
    }
  }
  for (const auto& [domain, programs] : heard) {
    report.problem(
        fmt::format("domain {} has: {}", domain, list_of(programs)),
        fmt::format("--domain {}, or domain: {} in the fabric's file, joins it", domain, domain));
  }
  for (const std::uint32_t domain : found.domains_here) {
    if (domain != found.joining.domain && !heard.contains(domain)) {
      report.warning(fmt::format("a process of this host uses the ports of DDS domain {}", domain),
                     fmt::format("try that domain: --domain {}", domain));
    }
  }
}

void at_other_interfaces(const Findings& found, Report& report) {
  const Interface* own = own_interface(found);
  for (const std::string& name : found.listening_interfaces) {
    if (own != nullptr && name != own->name) {
      report.problem(fmt::format("a process of this host uses interface {}, this one uses {}",
                                 safe(name), safe(own->name)),
                     fmt::format("use the same fabric file for all processes (--fabric-config or "
                                 "MILLRACE_FABRIC_CONFIG), with interface: \"{}\"",
                                 safe(name)));
    }
  }
}

void blame_the_network(const Findings& found, Report& report) {
  if (on_loopback(found)) {
    report.problem(
        "this process uses only the loopback interface, and no other process is on this host",
        "start the processes, or name the network's interface in a fabric file (--fabric-config)");
  } else if (!found.joining.multicast && found.joining.peers.empty()) {
    report.problem("multicast is off and no peers are listed, so no process can be found",
                   "set multicast: true, or list the other hosts in peers");
  } else if (found.joining.multicast) {
    report.problem(
        fmt::format("no announcement came by multicast on {}", safe(found.joining.interface)),
        found.joining.peers.empty()
            ? "if the network blocks multicast (group 239.255.0.1, UDP), list the other hosts in "
              "peers; otherwise start the processes there"
            : "start the processes on the other hosts, with this host in their peers");
  }
}

/// Why an announced participant and this process reject each other; false if trust does not explain
/// it.
bool blame_trust(const Findings& found, const ReceivedAnnouncement& each, Report& report) {
  const bool ours = !found.joining.trusted_as.empty();
  const std::string who = fmt::format("{} ({})", program_text(each.who), each.from);
  const std::string certificate =
      each.who.certificate.empty()
          ? "a certificate"
          : fmt::format("the certificate {} of {}", safe(each.who.certificate),
                        safe(each.who.authority));
  if (ours && !each.who.shows_certificate) {
    report.warning(who + " has no certificate: processes with trust ignore it",
                   "if it belongs to this plant, name its folder in its fabric file: trust { "
                   "folder: \"…\" } (`millrace trust issue` makes it)");
  } else if (ours) {
    report.problem(fmt::format("{} has {}, and this process does not accept it", who, certificate),
                   "it belongs to another PKI, has expired or was revoked, has the other "
                   "protection (SIGN here, ENCRYPT there), or its packets are lost: see the log of "
                   "that process and `millrace trust list`");
  } else if (each.who.shows_certificate) {
    report.problem(
        fmt::format("{} has {} and ignores processes without a certificate, such as this one", who,
                    certificate),
        "name what this host got from `millrace trust issue` in the fabric file: trust { folder: "
        "\"…\" }");
  } else {
    return false;
  }
  return true;
}

}  // namespace

/// Multicast arrives, but packets to one host alone do not.
void for_half_deaf(const Findings& found, Report& report) {
  const bool trusted = !found.joining.trusted_as.empty();
  const auto needs_trust = [&](const ReceivedAnnouncement& each) {
    return trusted || each.who.shows_certificate;
  };
  for (const ReceivedAnnouncement& each : found.heard) {
    // Cyclone shows participants that reject this process or that it rejects, but none of their
    // endpoints.
    const bool known = std::ranges::any_of(found.programs, [&](const Program& program) {
      return program.prefix == each.who.prefix && (!needs_trust(each) || !program.fabrics.empty());
    });
    if (each.domain == found.joining.domain && !known && !blame_trust(found, each, report)) {
      report.problem(fmt::format("{} ({}) announces itself on this domain but does not respond",
                                 program_text(each.who), each.from),
                     fmt::format("allow UDP in both directions: ports {} to {}, and the ports from "
                                 "which the processes send (processes_per_host makes them fixed)",
                                 discovery_port(found.joining.domain),
                                 discovery_port(found.joining.domain) + ports_per_domain - 1));
    }
  }
}

void for_the_others(const Findings& found, const std::set<std::string>& others, Report& report) {
  report.problem(fmt::format("no other process is on fabric '{}', domain {}",
                             safe(found.joining.fabric), found.joining.domain),
                 "");
  const std::size_t before = report.size();
  if (!others.empty()) {
    report.problem(fmt::format("this domain has the fabrics: {}", list_of(others)),
                   "--fabric NAME, or fabric: \"NAME\" in the fabric's file, joins one of them");
  }
  at_other_domains(found, report);
  for_half_deaf(found, report);
  at_other_interfaces(found, report);
  if (report.size() == before) {
    blame_the_network(found, report);
  }
}

}  // namespace millrace::tools::doctor::checks
