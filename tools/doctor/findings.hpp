// The findings of an examination of a fabric. Plain values: diagnose.hpp evaluates them.
#pragma once

#include <chrono>
#include <set>
#include <string>
#include <vector>

#include "base/messages/message.hpp"
#include "fabric/participant_identity.hpp"
#include "fabric/plant/plant.hpp"
#include "fabric/process_version.hpp"
#include "tools/doctor/announcement_receiver.hpp"
#include "tools/doctor/clock.hpp"
#include "tools/doctor/network.hpp"

namespace millrace::tools::doctor {

/// How this process joins the fabric.
struct Joining {
  std::string fabric{};
  std::uint32_t domain = 0;
  /// For suggested commands (fabric::profile::given_flags).
  std::string flags{};
  /// Name or IPv4 address.
  std::string interface = "lo";
  bool multicast = true;
  std::vector<std::string> peers{};
  /// Cyclone is also configured by CYCLONEDDS_URI, which may override this.
  bool cyclone_uri = false;
  /// Of millrace.
  std::string version{};
  /// The name in its certificate, and the certificate's expiry; empty without trust.
  std::string trusted_as{};
  std::chrono::sys_seconds trusted_until{};
  /// The participants on the CRL, and the time of the CRL.
  std::set<std::string> revoked{};
  std::chrono::sys_seconds revoked_as_of{};
  /// The time of the examination.
  std::chrono::sys_seconds now{};
};

/// A process on the domain, of any fabric.
struct Program {
  GuidPrefix prefix{};
  std::string name{};
  std::string host{};
  std::string pid{};
  std::string addresses{};
  bool self = false;
  /// As announced; otherwise the wire versions of its topics.
  fabric::ProcessVersion version{};
  /// The fabrics in which it has endpoints.
  std::set<std::string> fabrics{};
  /// It has the writers of a gateway; is_received() shows whether samples arrive.
  bool is_gateway = false;
  /// With trust: it announces an identity.
  bool announces_identity = true;
  /// It reads the requests of these UUIDs.
  std::set<std::string> serves{};
};

/// An endpoint on a topic of this fabric that matches no endpoint of a millrace process.
struct Misfit {
  std::string topic{};
  bool writer = false;
  /// "name on host, pid 17"
  base::messages::Message program{};
  std::vector<base::messages::Message> reasons{};
};

struct HostClock {
  std::string host{};
  /// The process with the other clock.
  std::string program{};
  ClockDifference difference{};
};

struct Findings {
  Joining joining{};
  /// Why the domain cannot be joined; then nothing below is known.
  std::string obstacle{};
  std::vector<Interface> interfaces{};
  /// Of this host.
  std::set<std::uint32_t> domains_here{};
  std::set<std::string> listening_interfaces{};
  std::vector<ReceivedAnnouncement> announcements{};
  base::messages::Message deaf{};
  std::vector<Program> programs{};
  std::vector<Misfit> misfits{};
  /// Discovered instances with invalid user_data.
  std::vector<base::messages::Message> ignored{};
  /// The proved identities of the others; only with trust.
  std::vector<fabric::ParticipantIdentity> identities{};
  /// The rejected samples and their writers.
  std::vector<std::string> doubts{};
  std::vector<Peer> peers{};
  std::vector<HostClock> clocks{};
  fabric::plant::Plant live{};
  /// Machines whose gateways were gone before the examination, from a process that knew them.
  std::vector<fabric::plant::LostMachine> lost{};
};

/// All machines whose gateways are gone.
std::vector<fabric::plant::LostMachine> lost_machines(const Findings& found);

/// A gateway that publishes a machine. The DDS participant of a killed or hanging one stays for a
/// while.
bool is_received(const Findings& found, const Program& gateway);

}  // namespace millrace::tools::doctor
