// The commands of a channel under the COM task (port 553): execution mode; selection, start and
// reset of NC programs.
//
//   write(553, {0x120101, 0x104}, u32(2));              // mode automatic
//   write(553, {0x120101, 0x108}, "demo.nc");           // the program
//   write(553, {0x120101, 0x105}, u32(3));              // state ready: select it
//   write(553, {0x120101, 0x105}, u32(4));              // state active: start it
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Execution mode and block search: block_search.hpp. 0x104 mode, 0x105 state, 0x108 parameter:
/// these offsets come from an early version of an open-source client, and no page confirms them
/// (our choice); the documented way to command them is the PLC. 0x1 and 0x3 single block. 0x9, 0xA
/// and 0xC feed override (in 0.1 %, up to 200 %; the unit is inferred). 0x90 a packet for the
/// streaming program (IB/tf5200_data_streaming/222591499, documented; the offset from that client).
///
/// mc_block_count_r, the feedrates (in µm/s), mc_command_block_ignore (levels from the next start
/// on) and mc_command_M01_stop_enable have the names that an open-source client of real controllers
/// reads, at offsets of our choice. A command that cannot be executed fails with invalid_data, and
/// the operator gets the reason.
void add_commands(ObjectTable& table);

}  // namespace millrace::cnc::simulator::objects
