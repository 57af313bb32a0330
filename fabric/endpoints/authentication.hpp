// Which participants of a domain have not proved yet who they are.
#pragma once

#include <cstddef>

#include "fabric/dds/participant.hpp"

namespace millrace::fabric::endpoints {

/// The participants that are announced and show no endpoint, always 0 without trust. DDS Security
/// lets a participant show its endpoints only once it is authenticated, which takes a tenth of a
/// second and longer on a busy host; that of another plant never does. Reads the whole discovery of
/// the domain. Throws std::runtime_error with Cyclone's reason.
std::size_t count_unauthenticated(const dds::Participant& participant);

}  // namespace millrace::fabric::endpoints
