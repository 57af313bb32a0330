#include "tools/doctor/checks/absence.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/checks/interface.hpp"
#include "tools/doctor/checks/words.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

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
      report.warning(
          fmt::format("a program of this host has the ports of DDS domain {} open", domain),
          fmt::format("look there: --domain {}", domain));
    }
  }
}

void at_other_interfaces(const Findings& found, Report& report) {
  const Interface* own = own_interface(found);
  for (const std::string& name : found.listening_interfaces) {
    if (own != nullptr && name != own->name) {
      report.problem(fmt::format("a program of this host is on interface {}, this one looks at {}",
                                 safe(name), safe(own->name)),
                     fmt::format("use the same fabric file for all: --fabric-config, or "
                                 "MILLRACE_FABRIC_CONFIG; it says interface: \"{}\"",
                                 safe(name)));
    }
  }
}

void blame_the_network(const Findings& found, Report& report) {
  if (on_loopback(found)) {
    report.problem("this program looks at this host only, and nobody is there",
                   "start the programs, or name the network's interface in a fabric file "
                   "(--fabric-config)");
  } else if (!found.joining.multicast && found.joining.peers.empty()) {
    report.problem("multicast is off and no peers are named, so nobody can be found",
                   "set multicast: true, or name the other hosts in peers");
  } else if (found.joining.multicast) {
    report.problem(
        fmt::format("no announcement came by multicast on {}", safe(found.joining.interface)),
        found.joining.peers.empty()
            ? "if the network lets no multicast through (group 239.255.0.1, UDP), name the "
              "other hosts in peers; else start the programs there"
            : "start the programs on the other hosts, with this host among their peers");
  }
}

}  // namespace

namespace {

/// Why somebody who is heard is not believed, or does not believe us; false if trust explains
/// nothing.
bool blame_trust(const Findings& found, const ReceivedAnnouncement& each, Report& report) {
  const bool ours = !found.joining.trusted_as.empty();
  const std::string who = fmt::format("{} ({})", program_text(each.who), each.from);
  const std::string certificate =
      each.who.certificate.empty()
          ? "a certificate"
          : fmt::format("the certificate {} of {}", safe(each.who.certificate),
                        safe(each.who.authority));
  if (ours && !each.who.shows_certificate) {
    report.warning(who + " shows no certificate: nobody who has trust believes or answers it",
                   "if it belongs to this plant, name its folder in its fabric file: trust { "
                   "folder: \"…\" } (`millrace trust issue` makes it)");
  } else if (ours) {
    report.problem(
        fmt::format("{} shows {} and is not believed here", who, certificate),
        "it is of another plant, has expired or been revoked, has the other protection (SIGN here, "
        "ENCRYPT there), or its packets do not come through: the log of that program and "
        "`millrace trust list` say more");
  } else if (each.who.shows_certificate) {
    report.problem(
        fmt::format("{} shows {} and hears nobody who shows none, as this program does", who,
                    certificate),
        "name what this host got from `millrace trust issue` in the fabric file: trust { folder: "
        "\"…\" }");
  } else {
    return false;
  }
  return true;
}

}  // namespace

/// Multicast comes through, but what is sent to one of us alone does not.
void for_half_deaf(const Findings& found, Report& report) {
  const bool trusted = !found.joining.trusted_as.empty();
  const auto needs_trust = [&](const ReceivedAnnouncement& each) {
    return trusted || each.who.shows_certificate;
  };
  for (const ReceivedAnnouncement& each : found.heard) {
    // Cyclone shows participants whom it does not believe, or who do not believe it, but none
    // of their endpoints.
    const bool known = std::ranges::any_of(found.programs, [&](const Program& program) {
      return program.prefix == each.who.prefix && (!needs_trust(each) || !program.fabrics.empty());
    });
    if (each.domain == found.joining.domain && !known && !blame_trust(found, each, report)) {
      report.problem(
          fmt::format("{} ({}) announces itself on this domain but does not answer",
                      program_text(each.who), each.from),
          fmt::format("let UDP through in both directions: ports {} to {} and those from "
                      "which the programs answer (processes_per_host gives them fixed ones)",
                      discovery_port(found.joining.domain),
                      discovery_port(found.joining.domain) + ports_per_domain - 1));
    }
  }
}

void for_the_others(const Findings& found, const std::set<std::string>& others, Report& report) {
  report.problem(fmt::format("nobody else is on fabric '{}', domain {}", safe(found.joining.fabric),
                             found.joining.domain),
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
