// The interface by which this process joins the fabric.
#pragma once

#include "tools/doctor/findings.hpp"

namespace millrace::tools::doctor::checks {

/// nullptr if this host has none of that name or address.
const Interface* own_interface(const Findings& found);
/// Only processes of this host are visible then.
bool on_loopback(const Findings& found);

}  // namespace millrace::tools::doctor::checks
