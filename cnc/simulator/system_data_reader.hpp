// What the configuration says of system data, checked.
#pragma once

#include <vector>

#include "base/configuration/mistakes.hpp"
#include "cnc/simulator/system_data.hpp"
#include "idl/cnc.pb.h"

namespace millrace::cnc::simulator {

/// Notes every mistake with its place.
std::vector<DataDeclaration> read_system_data(const config::Cnc& config,
                                              base::configuration::Mistakes& mistakes);

}  // namespace millrace::cnc::simulator
