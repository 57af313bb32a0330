#include "tools/doctor/diagnose.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "tools/print/quoted.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::doctor {

namespace {

using print::safe;

/// Clocks that differ less than this are as good as set: recordings stay readable.
constexpr std::chrono::nanoseconds small_difference = std::chrono::milliseconds(100);
/// From here on times of two hosts mean nothing together.
constexpr std::chrono::nanoseconds large_difference = std::chrono::seconds(10);

std::string list_of(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "" : ", ") + safe(name);
  }
  return text;
}

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string program_text(const Announcement& who) {
  const std::string& name = who.name.empty() ? who.process : who.name;
  return fmt::format("{}{}{}", name.empty() ? "a program" : safe(name),
                     who.host.empty() ? "" : " on " + safe(who.host),
                     who.pid.empty() ? "" : ", pid " + safe(who.pid));
}

class Doctor {
 public:
  explicit Doctor(const Findings& findings) : found_(findings) {
    for (const Program& program : found_.programs) {
      if (program.self) {
        continue;
      }
      if (program.fabrics.contains(found_.joining.fabric)) {
        ours_.push_back(&program);
      } else {
        other_fabrics_.insert(program.fabrics.begin(), program.fabrics.end());
      }
    }
  }

  std::vector<Diagnosis> examine() {
    look_at_the_interface();
    if (!found_.obstacle.empty()) {
      problem("the fabric cannot be joined: " + found_.obstacle,
              "put the configuration right (--fabric-config, CYCLONEDDS_URI)");
      return std::move(said_);
    }
    look_who_is_there();
    look_at_peers();
    look_at_endpoints();
    look_at_machines();
    look_at_channels();
    look_at_versions();
    look_at_clocks();
    return std::move(said_);
  }

 private:
  void say(Severity severity, std::string what, std::string advice = {}) {
    said_.push_back({severity, std::move(what), std::move(advice)});
  }
  void problem(std::string what, std::string advice) {
    say(Severity::problem, std::move(what), std::move(advice));
  }
  void warning(std::string what, std::string advice) {
    say(Severity::warning, std::move(what), std::move(advice));
  }
  void fine(std::string what) { say(Severity::fine, std::move(what)); }

  [[nodiscard]] const Interface* interface() const {
    const auto found = std::ranges::find_if(found_.interfaces, [&](const Interface& each) {
      return each.name == found_.joining.interface ||
             (!each.address.empty() && each.address == found_.joining.interface);
    });
    return found == found_.interfaces.end() ? nullptr : &*found;
  }
  [[nodiscard]] bool on_loopback() const {
    const Interface* own = interface();
    return own != nullptr && own->loopback;
  }

  void look_at_the_interface() {
    const std::string& name = found_.joining.interface;
    const Interface* own = interface();
    if (found_.joining.cyclone_uri) {
      warning("CYCLONEDDS_URI is set and may change interface, multicast and peers",
              "unset it unless you know why it is there; the fabric's file says the same in words");
    }
    if (own == nullptr) {
      problem(fmt::format("this host has no interface '{}'", safe(name)),
              fmt::format("name one of {} in the fabric's file", interface_list()));
    } else if (!own->up) {
      problem(fmt::format("interface {} is down", safe(own->name)),
              fmt::format("ip link set {} up", safe(own->name)));
    } else if (own->address.empty()) {
      problem(fmt::format("interface {} has no IPv4 address", safe(own->name)),
              fmt::format("ip address add ADDRESS/LENGTH dev {}", safe(own->name)));
    } else if (found_.joining.multicast && !own->multicast && !own->loopback) {
      problem(fmt::format("interface {} does no multicast", safe(own->name)),
              "set multicast: false and name the other hosts in peers");
    } else {
      fine(fmt::format("interface {} ({}) is up{}", safe(own->name), own->address,
                       own->loopback ? "; programs of this host only" : ""));
    }
    if (!found_.deaf.empty() && found_.joining.multicast) {
      warning(found_.deaf, "multicast could not be looked at; run the doctor as another user");
    }
  }

  [[nodiscard]] std::string interface_list() const {
    std::set<std::string> names;
    for (const Interface& each : found_.interfaces) {
      names.insert(each.name);
    }
    return list_of(names);
  }

  void look_who_is_there() {
    if (ours_.empty()) {
      nobody();
      return;
    }
    std::set<std::string> hosts;
    for (const Program* program : ours_) {
      hosts.insert(program->host.empty() ? program->addresses : program->host);
    }
    fine(fmt::format("on this fabric: {} on {}", counted(ours_.size(), "other program"),
                     counted(hosts.size(), "host")));
    if (std::ranges::none_of(ours_, &Program::is_gateway)) {
      problem("no gateway is on this fabric, so no controller is asked for calls",
              "start millrace-gateway with the same fabric and domain" + elsewhere());
    }
    if (found_.live.instances().empty()) {
      problem("no service is on this fabric, so no call can be answered",
              "start a service with the same fabric and domain" + elsewhere());
    }
    look_for_half_deaf();
  }

  /// Nobody of this fabric is there: where are they?
  void nobody() {
    problem(fmt::format("nobody else is on fabric '{}', domain {}", safe(found_.joining.fabric),
                        found_.joining.domain),
            "");
    const std::size_t before = said_.size();
    if (!other_fabrics_.empty()) {
      problem(fmt::format("this domain has the fabrics: {}", list_of(other_fabrics_)),
              "--fabric NAME, or fabric: \"NAME\" in the fabric's file, joins one of them");
    }
    look_at_other_domains();
    look_for_half_deaf();
    look_at_other_interfaces();
    if (said_.size() == before) {
      blame_the_network();
    }
  }

  void look_at_other_domains() {
    std::map<std::uint32_t, std::set<std::string>> heard;
    for (const Heard& each : found_.heard) {
      if (each.domain != found_.joining.domain) {
        heard[each.domain].insert(fmt::format("{} ({})", program_text(each.who), each.from));
      }
    }
    for (const auto& [domain, programs] : heard) {
      problem(
          fmt::format("domain {} has: {}", domain, list_of(programs)),
          fmt::format("--domain {}, or domain: {} in the fabric's file, joins it", domain, domain));
    }
    for (const std::uint32_t domain : found_.domains_here) {
      if (domain != found_.joining.domain && !heard.contains(domain)) {
        warning(fmt::format("a program of this host has the ports of DDS domain {} open", domain),
                fmt::format("look there: --domain {}", domain));
      }
    }
  }

  /// Multicast comes through, but what is sent to one of us alone does not.
  void look_for_half_deaf() {
    for (const Heard& each : found_.heard) {
      const bool known = std::ranges::any_of(found_.programs, [&](const Program& program) {
        return program.prefix == each.who.prefix;
      });
      if (each.domain == found_.joining.domain && !known) {
        problem(fmt::format("{} ({}) announces itself on this domain but does not answer",
                            program_text(each.who), each.from),
                fmt::format("let UDP through in both directions: ports {} to {} and those from "
                            "which the programs answer (processes_per_host gives them fixed ones)",
                            discovery_port(found_.joining.domain),
                            discovery_port(found_.joining.domain) + ports_per_domain - 1));
      }
    }
  }

  void look_at_other_interfaces() {
    const Interface* own = interface();
    for (const std::string& name : found_.listening_interfaces) {
      if (own != nullptr && name != own->name) {
        problem(fmt::format("a program of this host is on interface {}, this one looks at {}",
                            safe(name), safe(own->name)),
                fmt::format("use the same fabric file for all: --fabric-config, or "
                            "MILLRACE_FABRIC_CONFIG; it says interface: \"{}\"",
                            safe(name)));
      }
    }
  }

  void blame_the_network() {
    if (on_loopback()) {
      problem("this program looks at this host only, and nobody is there",
              "start the programs, or name the network's interface in a fabric file "
              "(--fabric-config)");
    } else if (!found_.joining.multicast && found_.joining.peers.empty()) {
      problem("multicast is off and no peers are named, so nobody can be found",
              "set multicast: true, or name the other hosts in peers");
    } else if (found_.joining.multicast) {
      problem(
          fmt::format("no announcement came by multicast on {}", safe(found_.joining.interface)),
          found_.joining.peers.empty()
              ? "if the network lets no multicast through (group 239.255.0.1, UDP), name the "
                "other hosts in peers; else start the programs there"
              : "start the programs on the other hosts, with this host among their peers");
    }
  }

  [[nodiscard]] std::string elsewhere() const {
    return other_fabrics_.empty()
               ? ""
               : fmt::format("; this domain also has the fabrics {}", list_of(other_fabrics_));
  }

  void look_at_peers() {
    for (const Peer& peer : found_.peers) {
      const bool seen = std::ranges::any_of(found_.programs, [&](const Program& program) {
        return !program.self && !peer.address.empty() &&
               program.addresses.find("/" + peer.address + ":") != std::string::npos;
      });
      if (seen) {
        fine(fmt::format("peer {} ({}) is there", safe(peer.name), peer.address));
      } else {
        missing(peer);
      }
    }
  }

  void missing(const Peer& peer) {
    const std::string who = peer.address.empty() || peer.address == peer.name
                                ? safe(peer.name)
                                : fmt::format("{} ({})", safe(peer.name), peer.address);
    switch (peer.reach) {
      case Reach::unknown_name:
        problem(fmt::format("peer {} has no address: {}", who, peer.detail),
                "correct the name, or write its IPv4 address");
        break;
      case Reach::unreachable:
        problem(fmt::format("peer {} cannot be reached: {}", who, peer.detail),
                "look at its power, its cable and the route to it (ip route get)");
        break;
      case Reach::refused:
        problem(fmt::format("peer {} is up, but no program of domain {} listens there", who,
                            found_.joining.domain),
                "start the programs there, with the same domain and an interface that faces this "
                "host");
        break;
      case Reach::silent:
        problem(fmt::format("peer {} does not answer", who),
                fmt::format("let UDP ports {} to {} through on both hosts; start the programs "
                            "there",
                            discovery_port(found_.joining.domain),
                            discovery_port(found_.joining.domain) + ports_per_domain - 1));
        break;
    }
  }

  void look_at_endpoints() {
    for (const Misfit& misfit : found_.misfits) {
      for (const std::string& reason : misfit.reasons) {
        problem(fmt::format("the {} of {} of {} fits no millrace program: {}",
                            misfit.writer ? "writer" : "reader", misfit.topic, safe(misfit.program),
                            safe(reason)),
                "give it the QoS and types of docs/architecture.md and idl/millrace.idl, or the "
                "same version of millrace");
      }
    }
    for (const std::string& each : found_.ignored) {
      problem(safe(each), "start a millrace service of this version");
    }
  }

  void look_at_machines() {
    std::set<std::string> connected;
    std::map<std::string, const fabric::MachineStatus*> down;
    for (const auto& [key, status] : found_.live.machines()) {
      if (status.connected) {
        connected.insert(status.machine);
        fine(fmt::format("{} is connected to its gateway on {}", safe(status.machine),
                         safe(status.host)));
      } else if (!down.contains(status.machine) || !status.host.empty()) {
        // One that is gone says less than one that stands there.
        down[status.machine] = &status;
      }
    }
    for (const auto& [machine, status] : down) {
      if (!connected.contains(machine)) {
        no_link(*status);
      } else if (!status->host.empty()) {
        fine(fmt::format("another gateway of {} stands by on {}: {}", safe(machine),
                         safe(status->host), safe(status->reason)));
      }
    }
  }

  void no_link(const fabric::MachineStatus& status) {
    problem(fmt::format("{} has no link: {}", safe(status.machine), safe(status.reason)),
            status.host.empty()
                ? "start its gateway again"
                : fmt::format("look at the controller at {} and at the gateway's log on {}",
                              safe(status.address), safe(status.host)));
  }

  [[nodiscard]] bool is_told(const std::string& machine) const {
    return std::ranges::any_of(found_.live.machines(),
                               [&](const auto& each) { return each.second.machine == machine; });
  }

  void look_at_channels() {
    using enum fabric::ChannelState;
    for (const auto& [key, status] : found_.live.channels()) {
      const std::string channel = safe(key.to_string());
      const std::string why = safe(status.reason);
      if (status.state == link_down && !is_told(key.machine)) {
        problem(fmt::format("{} has no link: {}", channel, why), "see its gateway's log");
      } else if (status.state == unserved) {
        problem(fmt::format("{} waits for {}, which nobody serves: {}", channel, safe(status.uuid),
                            why),
                "start the service, or correct the UUID in the program");
      } else if (status.state == held) {
        problem(fmt::format("{} holds an at-most-once call: {}", channel, why),
                fmt::format("millrace answer {} RESPONSE --state N, or millrace retry {}", channel,
                            channel));
      } else if (status.state == waiting) {
        warning(fmt::format("{} waits for a free instance: {}", channel, why),
                "start more instances; millrace stats shows how busy they are");
      }
    }
  }

  void look_at_versions() {
    for (const auto& [key, status] : found_.live.machines()) {
      if (!status.version.empty() && status.version != found_.joining.version) {
        warning(fmt::format("the gateway of {} is millrace {}, this is {}", safe(status.machine),
                            safe(status.version), found_.joining.version),
                "bring all hosts to one version");
      }
    }
    std::map<std::string, std::set<std::string>> versions;
    for (const auto& [id, instance] : found_.live.instances()) {
      versions[instance.identity.uuid].insert(instance.identity.version);
    }
    for (const auto& [uuid, all] : versions) {
      if (all.size() > 1) {
        warning(fmt::format("the instances of {} have versions {}", safe(uuid), list_of(all)),
                "fine during an upgrade; else drain the old ones");
      }
    }
  }

  void look_at_clocks() {
    for (const HostClock& clock : found_.clocks) {
      const auto ahead = clock.difference.ahead;
      const auto sure = std::chrono::abs(ahead) - clock.difference.error;
      const std::string text =
          fmt::format("the clock of {} is {} {} this host's (± {}, asked {})", safe(clock.host),
                      print::duration_text(std::chrono::abs(ahead)),
                      ahead < std::chrono::nanoseconds::zero() ? "behind" : "ahead of",
                      print::duration_text(clock.difference.error), safe(clock.program));
      if (sure > large_difference) {
        problem(text, "synchronise the hosts (chrony, NTP): deadlines and times are wrong");
      } else if (sure > small_difference) {
        warning(text, "synchronise the hosts (chrony, NTP): times in recordings do not agree");
      } else {
        fine(text);
      }
    }
  }

  const Findings& found_;
  /// Others on this fabric.
  std::vector<const Program*> ours_;
  std::set<std::string> other_fabrics_;
  std::vector<Diagnosis> said_;
};

}  // namespace

std::string_view name_of(Severity severity) {
  constexpr std::array<std::string_view, 3> names{"fine", "warning", "problem"};
  return names.at(static_cast<std::size_t>(severity));
}

std::vector<Diagnosis> diagnose(const Findings& findings) {
  return Doctor(findings).examine();
}

bool is_healthy(const std::vector<Diagnosis>& diagnoses) {
  return std::ranges::none_of(
      diagnoses, [](Severity severity) { return severity == Severity::problem; },
      &Diagnosis::severity);
}

}  // namespace millrace::tools::doctor
