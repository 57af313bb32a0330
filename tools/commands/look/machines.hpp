// The rows and columns of `millrace machines`. Pure.
#pragma once

#include <string>
#include <vector>

#include "fabric/plant/plant.hpp"
#include "tools/print/listing.hpp"

namespace millrace::tools::commands::look {

/// Those without a connection first.
std::vector<fabric::MachineStatus> machine_rows(const fabric::plant::Plant& live);
const print::Listing<fabric::MachineStatus>& machines_listing();

/// "up", "down", "no gateway".
std::string link_of(const fabric::MachineStatus& status);

}  // namespace millrace::tools::commands::look
