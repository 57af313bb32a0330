// The interface by which this program joins the fabric.
#pragma once

#include "tools/doctor/findings.hpp"

namespace millrace::tools::doctor::checks {

/// nullptr if this host has none of that name or address.
const Interface* own_interface(const Findings& found);
/// Programs of this host only can be seen then.
bool on_loopback(const Findings& found);

}  // namespace millrace::tools::doctor::checks
