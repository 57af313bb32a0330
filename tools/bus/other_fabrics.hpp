// The other fabrics of a DDS domain: processes that a wrong --fabric does not see.
#pragma once

#include <set>
#include <string>

#include "fabric/dds/participant.hpp"

namespace millrace::tools::bus {

/// The names of the fabrics, but for that of `participant`, in which processes have endpoints now.
/// With trust: of authenticated processes. At most 16: a stranger can announce any number. Throws
/// std::runtime_error with Cyclone's reason.
std::set<std::string> other_fabrics(const fabric::dds::Participant& participant);

}  // namespace millrace::tools::bus
