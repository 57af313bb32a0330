// A fabric.textproto (idl/fabric.proto) as participant options, so that users need no Cyclone XML.
//
//   Participant participant(read_profile("fabric.textproto").value());
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <tl/expected.hpp>

#include "fabric/dds/participant.hpp"

namespace millrace::config {
class Fabric;
}

namespace millrace::fabric::profile {

/// The profile of a host, from the packages.
inline constexpr const char* host_profile = "/etc/millrace/fabric.textproto";

/// The profile of a process without a flag for it. `said` is the value of MILLRACE_FABRIC_CONFIG,
/// or null: then it is the host's profile, if that exists. Empty for none; an empty `said` also
/// means none.
std::string profile_to_read(const char* named, const std::filesystem::path& of_host = host_profile);

/// The highest DDS domain whose ports exist.
inline constexpr std::uint32_t last_domain = 232;

/// The error holds one line per mistake, "FILE:LINE:COLUMN: what was expected".
tl::expected<dds::ParticipantOptions, std::string> read_profile(const std::filesystem::path& file);

/// The Cyclone configuration of a checked profile: interface, discovery and ports.
std::string cyclone_configuration(const config::Fabric& profile);

}  // namespace millrace::fabric::profile
