// Reads and checks the system data of the configuration.
#pragma once

#include <vector>

#include "base/configuration/mistakes.hpp"
#include "cnc/simulator/system_data.hpp"
#include "idl/cnc.pb.h"

namespace millrace::cnc::simulator {

/// Records every mistake with its place.
std::vector<DataDeclaration> read_system_data(const config::Cnc& config,
                                              base::configuration::Mistakes& mistakes);

}  // namespace millrace::cnc::simulator
