// Each checks a part of the findings and reports the result. Pure.
#pragma once

#include "tools/doctor/checks/report.hpp"
#include "tools/doctor/findings.hpp"

namespace millrace::tools::doctor::checks {

/// Does the interface exist, is it up, and does it support what the fabric needs?
void at_the_interface(const Findings& found, Report& report);
/// Are gateways and services on this fabric, and if not: why?
void who_is_there(const Findings& found, Report& report);
/// Is each configured peer there, and if not: why?
void at_peers(const Findings& found, Report& report);
/// The certificate of this process, its validity, and which other participants it accepts.
void at_trust(const Findings& found, Report& report);
/// Endpoints and instances that fit no millrace program.
void at_endpoints(const Findings& found, Report& report);
/// Is each machine connected to a gateway?
void at_machines(const Findings& found, Report& report);
/// Waiting channels, and their reasons.
void at_channels(const Findings& found, Report& report);
/// The alarms of processes.
void at_alarms(const Findings& found, Report& report);
/// Different versions on one fabric.
void at_versions(const Findings& found, Report& report);
/// Do the clocks of the hosts agree?
void at_clocks(const Findings& found, Report& report);

}  // namespace millrace::tools::doctor::checks
