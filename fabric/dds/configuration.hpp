// The Cyclone configuration of a fabric, as text.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "fabric/dds/participant.hpp"

namespace millrace::fabric::dds {

/// Whether CYCLONEDDS_URI applies. A program with a configuration of its own ignores the variable:
/// Cyclone adds interfaces up, and one named in both is an error.
bool uses_uri(const ParticipantOptions& options);

/// The UDP ports of a process, unless its profile or CYCLONEDDS_URI chooses them.
enum class Ports : std::uint8_t {
  /// The first free ones of this many pairs from 7410 + 250 × domain on.
  lowest,
  any,
};
inline constexpr std::uint32_t lowest_ports = 100;

/// Our settings, then those of `options`; then `uri` (the value of CYCLONEDDS_URI) if `options` has
/// none. A comma-separated list in which a later setting wins. The loopback interface is added
/// unless the list names an interface, directly or in a file. A participant that only announces
/// itself does so in the group of its domain, unless `options` has another way of finding others
/// (peers, no multicast, other ports), or `uri` applies.
std::string cyclone_configuration(const ParticipantOptions& options, std::string_view uri,
                                  Ports ports = Ports::lowest);

/// The configuration with which a process joins although others have all places of this host that
/// `options` allows: on any port, which those listed as peers do not ask.
std::string configuration_without_place(const ParticipantOptions& options, std::string_view uri);
/// True if Cyclone's log says that all places are taken.
bool lacks_place(std::string_view log);

/// Why a domain could not be joined: Cyclone's reason and log, and which setting to change.
std::string why_not_joined(std::uint32_t domain, std::string_view reason, std::string_view log,
                           std::string_view uri);

// The log of Cyclone while a process runs: lines on standard error, in Cyclone's format. Repeated
// lines (a rejected participant tries once a second) appear at growing intervals.

/// Installs this for the whole process.
void take_cyclone_log();
/// For commands that a person reads: leaves out the lines about rejected processes, which `millrace
/// doctor` reports in words.
void hide_rejections();
bool is_rejection(std::string_view line);

/// What lines of the same fault have in common: all words without digits. Words with digits are
/// ids, ports and times.
std::string kind_of_line(std::string_view text);

}  // namespace millrace::fabric::dds
