// The Cyclone configuration of a fabric, as text.
#pragma once

#include <string>
#include <string_view>

#include "fabric/dds/participant.hpp"

namespace millrace::fabric::dds {

/// Ours, then that of `options`, then `uri` (what CYCLONEDDS_URI holds): a comma-separated list in
/// which a later setting wins. The loopback interface is named only if neither of the others names
/// an interface, in place or in a file of theirs, because Cyclone adds interfaces up. Who only
/// announces himself does so in the group of his domain, unless his options have another way of
/// finding others (peers, no multicast, other ports), or there is a `uri`.
std::string cyclone_configuration(const ParticipantOptions& options, std::string_view uri);

}  // namespace millrace::fabric::dds
