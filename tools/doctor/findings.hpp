// What an examination of a fabric found. Plain values: what follows from them is in diagnose.hpp.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "fabric/participant_identity.hpp"
#include "tools/bus/fabric_model.hpp"
#include "tools/doctor/announcement_receiver.hpp"
#include "tools/doctor/clock.hpp"
#include "tools/doctor/network.hpp"
#include "tools/doctor/peer.hpp"

namespace millrace::tools::doctor {

/// How this program joins the fabric.
struct Joining {
  std::string fabric{};
  std::uint32_t domain = 0;
  /// Name or IPv4 address.
  std::string interface = "lo";
  bool multicast = true;
  std::vector<std::string> peers{};
  /// Cyclone is configured by CYCLONEDDS_URI, too, which may say otherwise.
  bool cyclone_uri = false;
  /// Of millrace.
  std::string version{};
  /// The name in the certificate that it shows, and how long that is valid; empty without trust.
  std::string trusted_as{};
  std::chrono::sys_seconds trusted_until{};
  /// Whom the list of revoked participants names, and when it was made.
  std::set<std::string> revoked{};
  std::chrono::sys_seconds revoked_as_of{};
  /// When this was looked at.
  std::chrono::sys_seconds now{};
};

/// A program that takes part in the domain, of whatever fabric.
struct Program {
  GuidPrefix prefix{};
  std::string name{};
  std::string host{};
  std::string pid{};
  std::string addresses{};
  bool self = false;
  /// The fabrics it has endpoints in.
  std::set<std::string> fabrics{};
  /// It has what a gateway tells of its machines with; whether it is heard says is_heard().
  bool is_gateway = false;
  /// Where there is trust: it has shown what its certificate lets it be.
  bool announces_identity = true;
  /// It takes the requests of these UUIDs.
  std::set<std::string> serves{};
};

/// An endpoint on a topic of this fabric that fits no endpoint of a millrace program.
struct Misfit {
  std::string topic{};
  bool writer = false;
  /// "name on host, pid 17"
  std::string program{};
  std::vector<std::string> reasons{};
};

struct HostClock {
  std::string host{};
  /// Whom we asked.
  std::string program{};
  ClockDifference difference{};
};

struct Findings {
  Joining joining{};
  /// Why the domain cannot be joined; nothing below is known then.
  std::string obstacle{};
  std::vector<Interface> interfaces{};
  /// Of this host.
  std::set<std::uint32_t> domains_here{};
  std::set<std::string> listening_interfaces{};
  std::vector<ReceivedAnnouncement> heard{};
  std::string deaf{};
  std::vector<Program> programs{};
  std::vector<Misfit> misfits{};
  /// Instances that discovery shows but whose words about themselves make no sense.
  std::vector<std::string> ignored{};
  /// What the others have proved to be; only with trust.
  std::vector<fabric::ParticipantIdentity> identities{};
  /// What is not believed, and of whom.
  std::vector<std::string> doubts{};
  std::vector<Peer> peers{};
  std::vector<HostClock> clocks{};
  bus::FabricModel live{};
  /// Machines whose gateways were gone before this looked, as somebody knows who was there then.
  std::vector<bus::LostMachine> lost{};
};

/// All machines whose gateways are gone.
std::vector<bus::LostMachine> lost_machines(const Findings& found);

/// A gateway that tells of a machine. The DDS participant of one that was killed or hangs stays for
/// a while.
bool is_heard(const Findings& found, const Program& gateway);

}  // namespace millrace::tools::doctor
