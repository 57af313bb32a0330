// Joins a fabric, listens for some seconds, compares the clocks of all hosts, and leaves.
#pragma once

#include <chrono>
#include <set>
#include <vector>

#include "fabric/dds/authenticator.hpp"
#include "fabric/dds/participant.hpp"
#include "fabric/wire/reader.hpp"
#include "tools/doctor/directory.hpp"
#include "tools/doctor/findings.hpp"

namespace millrace::tools::doctor {

struct Examination {
  fabric::dds::ParticipantOptions join{};
  /// The further contents of the fabric's file.
  Joining joining{};
  /// How long to listen. Each process announces itself at least once per lease, half a second
  /// unless configured.
  std::chrono::milliseconds listen{2000};
  /// Gateways that were gone before the examination, from a process that has listened for longer.
  std::vector<bus::LostMachine> lost{};
};

/// A fault of the network or configuration is a finding, not an exception.
Findings examine(const Examination& examination);

// Readers of every topic of a fabric, only to see which writers DDS matches with them.

class TopicReaders {
 public:
  /// Throws std::runtime_error with Cyclone's reason.
  explicit TopicReaders(const fabric::dds::Participant& participant);

  /// The writers that are matched with one of the readers.
  [[nodiscard]] std::set<Handle> matched() const;

 private:
  fabric::wire::Reader<fabric::Request> requests_;
  fabric::wire::Reader<fabric::Reply> replies_;
  fabric::wire::Reader<fabric::Heartbeat> heartbeats_;
  fabric::wire::Reader<fabric::ChannelStatus> channels_;
  fabric::wire::Reader<fabric::MachineStatus> machines_;
  fabric::wire::Reader<fabric::Event> events_;
  fabric::wire::Reader<fabric::Command> commands_;
  fabric::wire::Reader<fabric::Outcome> outcomes_;
  fabric::wire::Reader<fabric::Alarm> alarms_;
};

/// The mistakes in others' endpoints of this fabric: QoS or type match no millrace process, or DDS
/// does not match a writer although both fit.
std::vector<Misfit> misfits_in(const Directory& directory, const std::set<Handle>& matched,
                               const std::string& fabric);

/// The other processes on the domain. `authenticator` is null without trust.
std::vector<Program> programs_in(const Directory& directory, const std::string& fabric,
                                 const fabric::dds::Authenticator* authenticator);

}  // namespace millrace::tools::doctor
