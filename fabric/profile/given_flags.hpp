// The flags of a fabric for a command that a message suggests.
#pragma once

#include <string>

#include "fabric/profile/command_line.hpp"

namespace millrace::fabric::profile {

/// With a blank in front of each, as in " --domain 7"; empty if a command without flags joins the
/// same fabric.
std::string given_flags(const FabricFlags& flags);

}  // namespace millrace::fabric::profile
