// The objects of the COM task for the whole CNC. A client finds them by their names in the object
// directory. Names and types are those that an open-source client of real controllers reads; the
// addresses are our choice.
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Cycle counter and cycle time (in µs), version, numbers of channels and axes.
void add_platform(ObjectTable& table);

}  // namespace millrace::cnc::simulator::objects
