#include <algorithm>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "base/text/quoted.hpp"
#include "tools/doctor/checks/checks.hpp"

namespace millrace::tools::doctor::checks {

namespace {

namespace messages = base::messages;
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
      report.problem(messages::peer_without_address(who, peer.detail),
                     messages::correct_peer_name());
      break;
    case Reach::unreachable:
      report.problem(messages::peer_unreachable(who, peer.detail), messages::check_peer());
      break;
    case Reach::refused:
      report.problem(messages::peer_without_process(who, found.joining.domain),
                     messages::start_processes_there());
      break;
    case Reach::silent:
      report.problem(
          messages::peer_silent(who),
          messages::allow_udp_ports(discovery_port(found.joining.domain),
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
    report.warning(messages::cyclone_uri_set(), messages::unset_cyclone_uri());
  }
  if (own == nullptr) {
    report.problem(messages::no_such_interface(safe(name)),
                   messages::use_other_interface(interface_list(found)));
  } else if (!own->up) {
    report.problem(messages::interface_down(safe(own->name)),
                   messages::set_interface_up(safe(own->name)));
  } else if (!own->carrier) {
    report.problem(messages::interface_without_carrier(safe(own->name)), messages::check_cable());
  } else if (own->address.empty()) {
    report.problem(messages::interface_without_address(safe(own->name)),
                   messages::add_address(safe(own->name)));
  } else if (found.joining.multicast && !own->multicast && !own->loopback) {
    report.problem(messages::interface_without_multicast(safe(own->name)), messages::list_peers());
  } else {
    report.fine(own->loopback ? messages::loopback_up(safe(own->name), own->address)
                              : messages::interface_up(safe(own->name), own->address));
  }
  if (!found.deaf.empty() && found.joining.multicast) {
    report.warning(found.deaf, messages::multicast_not_checked());
  }
}

void at_peers(const Findings& found, Report& report) {
  for (const Peer& peer : found.peers) {
    const bool seen = std::ranges::any_of(found.programs, [&](const Program& program) {
      return !program.self && !peer.address.empty() &&
             program.addresses.find("/" + peer.address + ":") != std::string::npos;
    });
    if (seen) {
      report.fine(messages::peer_responds(safe(peer.name), peer.address));
    } else {
      missing(found, peer, report);
    }
  }
}

}  // namespace millrace::tools::doctor::checks
