// The functions for V.A. variables of one axis, 4 to 6 of the decoder. The upper half of the offset
// is the number of the channel's axis: 0x10005 reads a variable of the first axis
// (IB/tf5200_ads_access_to_cnc/312807307, 312808843, 312810379, documented).
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Names have no axis: "V.A.WCS".
void add_axis_functions(ObjectTable& table);

}  // namespace millrace::cnc::simulator::objects
