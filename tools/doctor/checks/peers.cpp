#include <algorithm>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/checks/checks.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

void missing(const Findings& found, const Peer& peer, Report& report) {
  const std::string who = peer.address.empty() || peer.address == peer.name
                              ? safe(peer.name)
                              : fmt::format("{} ({})", safe(peer.name), peer.address);
  switch (peer.reach) {
    case Reach::unknown_name:
      report.problem(fmt::format("peer {} has no address: {}", who, peer.detail),
                     "correct the name, or write its IPv4 address");
      break;
    case Reach::unreachable:
      report.problem(fmt::format("peer {} cannot be reached: {}", who, peer.detail),
                     "check its power, its cable and the route to it (ip route get)");
      break;
    case Reach::refused:
      report.problem(
          fmt::format("peer {} is up, but no process of domain {} listens there", who,
                      found.joining.domain),
          "start the processes there, with the same domain and an interface that faces this host");
      break;
    case Reach::silent:
      report.problem(
          fmt::format("peer {} does not respond", who),
          fmt::format("allow UDP ports {} to {} on both hosts; start the processes there",
                      discovery_port(found.joining.domain),
                      discovery_port(found.joining.domain) + ports_per_domain - 1));
      break;
  }
}

}  // namespace

void at_peers(const Findings& found, Report& report) {
  for (const Peer& peer : found.peers) {
    const bool seen = std::ranges::any_of(found.programs, [&](const Program& program) {
      return !program.self && !peer.address.empty() &&
             program.addresses.find("/" + peer.address + ":") != std::string::npos;
    });
    if (seen) {
      report.fine(fmt::format("peer {} ({}) responds", safe(peer.name), peer.address));
    } else {
      missing(found, peer, report);
    }
  }
}

}  // namespace millrace::tools::doctor::checks
