// The Cyclone configuration of a fabric, as text.
#pragma once

#include <string>
#include <string_view>

namespace millrace::fabric::dds {

/// Ours, then `extra`, then `uri` (what CYCLONEDDS_URI holds): a comma-separated list in which a
/// later setting wins. The loopback interface is named only if neither of the others names an
/// interface, in place or in a file of theirs, because Cyclone adds interfaces up.
std::string cyclone_configuration(std::string_view extra, std::string_view uri);

}  // namespace millrace::fabric::dds
