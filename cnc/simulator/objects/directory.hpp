// The object directory of the COM task: the objects and their addresses
// (IB/tf5200_ads_access_to_cnc/855973643, documented).
//
//   read(553, {0x130101, 0}, 4);             // UNS32: number of objects in channel 1's directory
//   read(553, {0x130101, 1}, 2 * 84);        // the records of the first two
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Adds to `table` the list of the objects of the CNC and of those of one channel, which are the
/// same for all. The directory of channel 0 has those of the CNC and of all channels; that of
/// channel 1 has those of the CNC and its own (documented); any other has its own. Offset 0 is the
/// number of records. Offset n is the records from n on, as many as fit into the client's buffer.
void add_directory(ObjectTable& table, const ObjectTable& cnc, const ObjectTable& channel);

}  // namespace millrace::cnc::simulator::objects
