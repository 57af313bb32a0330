#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "base/messages/catalogue.hpp"
#include "base/text/quoted.hpp"
#include "tools/doctor/checks/checks.hpp"

namespace millrace::tools::doctor::checks {

namespace {

namespace messages = base::messages;
using base::text::safe;
using messages::Message;

/// The other processes of the domain.
struct Peers {
  /// On this fabric.
  std::vector<const Program*> of_fabric;
  std::set<std::string> other_fabrics;
};

Peers peers_of(const Findings& found) {
  Peers peers;
  for (const Program& program : found.programs) {
    if (program.self) {
      continue;
    }
    if (program.fabrics.contains(found.joining.fabric)) {
      peers.of_fabric.push_back(&program);
    } else {
      peers.other_fabrics.insert(program.fabrics.begin(), program.fabrics.end());
    }
  }
  return peers;
}

Message counted(std::size_t programs, std::size_t hosts) {
  return programs == 1 ? messages::one_program_on_one_host()
         : hosts == 1  ? messages::programs_on_one_host(programs)
                       : messages::programs_on_hosts(programs, hosts);
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
std::set<std::string> hosts_of(const Peers& peers) {
  std::set<std::string> hosts;
  std::set<std::string> known;
  for (const Program* program : peers.of_fabric) {
    if (!program->host.empty()) {
      hosts.insert(program->host);
      known.insert(ip_of(program->addresses));
    }
  }
  for (const Program* program : peers.of_fabric) {
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
void for_the_silent(const Findings& found, const Peers& peers, Report& report) {
  const std::vector<fabric::plant::LostMachine> all_lost = lost_machines(found);
  for (const Program* program : peers.of_fabric) {
    const bool is_lost = std::ranges::any_of(all_lost, [&](const fabric::plant::LostMachine& lost) {
      return lost.last.host == program->host && std::to_string(lost.last.pid) == program->pid;
    });
    if (program->is_gateway && !is_lost && !is_received(found, *program)) {
      report.problem(messages::gateway_silent(safe(program->host), safe(program->pid)),
                     messages::restart_gateway(safe(program->host)));
    }
  }
}

Message with_other_fabrics(const Message& advice, const Peers& peers) {
  return peers.other_fabrics.empty()
             ? advice
             : messages::with_other_fabrics(advice, list_of(peers.other_fabrics));
}

}  // namespace

void gateways_and_services(const Findings& found, Report& report) {
  const Peers peers = peers_of(found);
  if (peers.of_fabric.empty()) {
    for_the_others(found, peers.other_fabrics, report);
    return;
  }
  report.fine(counted(peers.of_fabric.size(), hosts_of(peers).size()));
  for_the_silent(found, peers, report);
  if (std::ranges::none_of(peers.of_fabric, [&](const Program* program) {
        return program->is_gateway && is_received(found, *program);
      })) {
    report.problem(messages::no_gateway_here(),
                   with_other_fabrics(messages::start_gateway_here(), peers));
  }
  if (found.live.instances().empty()) {
    report.problem(messages::no_service_here(),
                   with_other_fabrics(messages::start_service_here(), peers));
  }
  for_half_deaf(found, report);
}

namespace {

void at_other_domains(const Findings& found, Report& report) {
  std::map<std::uint32_t, std::set<std::string>> announced;
  for (const ReceivedAnnouncement& each : found.announcements) {
    if (each.domain != found.joining.domain) {
      announced[each.domain].insert(messages::at_address(program_text(each.who), each.from).text);
    }
  }
  for (const auto& [domain, programs] : announced) {
    report.problem(messages::domain_has_processes(domain, list_of(programs)),
                   messages::join_other_domain(domain, domain));
  }
  for (const std::uint32_t domain : found.domains_here) {
    if (domain != found.joining.domain && !announced.contains(domain)) {
      report.warning(messages::domain_used_here(domain), messages::try_other_domain(domain));
    }
  }
}

void at_other_interfaces(const Findings& found, Report& report) {
  const Interface* own = own_interface(found);
  for (const std::string& name : found.listening_interfaces) {
    if (own != nullptr && name != own->name) {
      report.problem(messages::other_interface_used(safe(name), safe(own->name)),
                     messages::use_same_fabric_file(safe(name)));
    }
  }
}

void blame_the_network(const Findings& found, Report& report) {
  if (on_loopback(found)) {
    report.problem(messages::only_loopback(), messages::name_the_interface());
  } else if (!found.joining.multicast && found.joining.peers.empty()) {
    report.problem(messages::no_multicast_no_peers(), messages::set_multicast_or_peers());
  } else if (found.joining.multicast) {
    report.problem(messages::no_announcement(safe(found.joining.interface)),
                   found.joining.peers.empty() ? messages::network_blocks_multicast()
                                               : messages::start_processes_with_peers());
  }
}

/// Why an announced participant and this process reject each other; false if trust does not explain
/// it.
bool blame_trust(const Findings& found, const ReceivedAnnouncement& each, Report& report) {
  const bool trusted = !found.joining.trusted_as.empty();
  const Message who = messages::at_address(program_text(each.who), each.from);
  const Message certificate = each.who.certificate.empty()
                                  ? messages::a_certificate()
                                  : messages::certificate_of_authority(safe(each.who.certificate),
                                                                       safe(each.who.authority));
  if (trusted && !each.who.shows_certificate) {
    report.warning(messages::has_no_certificate(who), messages::name_its_folder());
  } else if (trusted) {
    report.problem(messages::certificate_not_accepted(who, certificate),
                   messages::why_not_accepted());
  } else if (each.who.shows_certificate) {
    report.problem(messages::ignores_without_certificate(who, certificate),
                   messages::name_own_folder());
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
  for (const ReceivedAnnouncement& each : found.announcements) {
    // Cyclone shows participants that reject this process or that it rejects, but none of their
    // endpoints.
    const bool known = std::ranges::any_of(found.programs, [&](const Program& program) {
      return program.prefix == each.who.prefix && (!needs_trust(each) || !program.fabrics.empty());
    });
    if (each.domain == found.joining.domain && !known && !blame_trust(found, each, report)) {
      report.problem(
          messages::announces_without_response(program_text(each.who), each.from),
          messages::allow_udp(discovery_port(found.joining.domain),
                              discovery_port(found.joining.domain) + ports_per_domain - 1));
    }
  }
}

void for_the_others(const Findings& found, const std::set<std::string>& others, Report& report) {
  report.problem(messages::no_other_process(safe(found.joining.fabric), found.joining.domain), "");
  const std::size_t before = report.size();
  if (!others.empty()) {
    report.problem(messages::domain_has_fabrics(list_of(others)), messages::join_other_fabric());
  }
  at_other_domains(found, report);
  for_half_deaf(found, report);
  at_other_interfaces(found, report);
  if (report.size() == before) {
    blame_the_network(found, report);
  }
}

}  // namespace millrace::tools::doctor::checks
