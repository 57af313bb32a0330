// The execution mode of a channel, and block search: a started NC program moves no axis before a
// certain block.
//
//   write(553, {0x120101, 0x3F}, u32(1));     // execution mode block search
//   write(553, {0x120101, 0x49}, u16(4));     // for a block number
//   write(553, {0x120101, 0x5F}, u32(120));   // N120
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// 0x3F to 0x41 execution mode (IB/tf5264_conveyor_tracking/1174455947, documented): 0 normal and 1
/// block search are simulated. 0x5F and 0x77 block number (IB/tf5200_blocksearch/348552331,
/// documented). 0x49 and 0x61 type of the search: 0 none, 4 a block number, as in an open-source
/// client of real controllers. Other values are not simulated and fail with invalid_data.
void add_block_search(ObjectTable& table);

}  // namespace millrace::cnc::simulator::objects
