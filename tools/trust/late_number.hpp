// A name for a participant that must not begin a handshake. Of two participants with DDS Security
// the one with the lower GUID begins, and its GUID begins with a hash of the name in its
// certificate (DDS Security 1.1, 9.3.3). Fast DDS 2.9 begins with a key agreement that Cyclone
// encodes differently (Fast-DDS issue 3802, Cyclone DDS issue 1547), but accepts Cyclone's if
// Cyclone begins. So a participant with Fast DDS gets a name whose hash is higher than those of the
// others. Pure.
//
//   subject.number = late_number(subject);
#pragma once

#include <string>

#include "base/openssl/certificate.hpp"

namespace millrace::tools::trust {

/// Eight digits that give the subject a hash whose first 20 bits are ones: of a million other names
/// one is higher. Takes half a second.
std::string late_number(base::openssl::Subject subject);

}  // namespace millrace::tools::trust
