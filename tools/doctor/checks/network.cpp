#include <algorithm>

#include <fmt/format.h>

#include "base/text/quoted.hpp"
#include "tools/doctor/checks/checks.hpp"

namespace millrace::tools::doctor::checks {

namespace {

using base::text::safe;

std::string interface_list(const Findings& found) {
  std::set<std::string> names;
  for (const Interface& each : found.interfaces) {
    names.insert(each.name);
  }
  return list_of(names);
}

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

const Interface* own_interface(const Findings& found) {
  const auto own = std::ranges::find_if(found.interfaces, [&](const Interface& each) {
    return each.name == found.joining.interface ||
           (!each.address.empty() && each.address == found.joining.interface);
  });
  return own == found.interfaces.end() ? nullptr : &*own;
}

bool on_loopback(const Findings& found) {
  const Interface* own = own_interface(found);
  return own != nullptr && own->loopback;
}

void at_the_interface(const Findings& found, Report& report) {
  const std::string& name = found.joining.interface;
  const Interface* own = own_interface(found);
  if (found.joining.cyclone_uri) {
    report.warning(
        "CYCLONEDDS_URI is set and may change interface, multicast and peers",
        "unset it, or name a fabric profile (--fabric-config), with which it is ignored");
  }
  if (own == nullptr) {
    report.problem(fmt::format("this host has no interface '{}'", safe(name)),
                   fmt::format("use one of {} in the fabric's file", interface_list(found)));
  } else if (!own->up) {
    report.problem(fmt::format("interface {} is down", safe(own->name)),
                   fmt::format("ip link set {} up", safe(own->name)));
  } else if (own->address.empty()) {
    report.problem(fmt::format("interface {} has no IPv4 address", safe(own->name)),
                   fmt::format("ip address add ADDRESS/LENGTH dev {}", safe(own->name)));
  } else if (found.joining.multicast && !own->multicast && !own->loopback) {
    report.problem(fmt::format("interface {} has no multicast", safe(own->name)),
                   "set multicast: false and list the other hosts in peers");
  } else {
    report.fine(fmt::format("interface {} ({}) is up{}", safe(own->name), own->address,
                            own->loopback ? "; processes of this host only" : ""));
  }
  if (!found.deaf.empty() && found.joining.multicast) {
    report.warning(found.deaf,
                   "multicast could not be checked; run millrace doctor as another user");
  }
}

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
