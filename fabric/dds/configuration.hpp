// The Cyclone configuration of a fabric, as text.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "fabric/dds/participant.hpp"

namespace millrace::fabric::dds {

/// Ours, then `extra`, then `uri` (what CYCLONEDDS_URI holds): a comma-separated list in which a
/// later setting wins. The loopback interface is named only if neither of the others names an
/// interface, in place or in a file of theirs, because Cyclone adds interfaces up. Who only
/// announces himself does so in the group of `domain`, unless `extra` has another way of finding
/// others (peers, no multicast, other ports), or there is a `uri`. Who is `trusted` shows a
/// certificate to those who join.
std::string cyclone_configuration(std::string_view extra, std::string_view uri,
                                  Finding finding = Finding::hears, std::uint32_t domain = 0,
                                  bool trusted = false);

}  // namespace millrace::fabric::dds
