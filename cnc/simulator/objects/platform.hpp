// What the COM task tells about the CNC as a whole. A client finds these objects by their names in
// the object directory; names and types are those an open-source client of real controllers reads,
// the addresses are our choice.
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Cycle counter and cycle time (in µs), version, numbers of channels and axes.
void add_platform(ObjectTable& table);

}  // namespace millrace::cnc::simulator::objects
