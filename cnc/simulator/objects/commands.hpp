// The commands of a channel under the COM task (port 553): execution mode; selection, start and
// reset of NC programs.
//
//   write(553, {0x120101, 0x104}, u32(2));              // mode automatic
//   write(553, {0x120101, 0x108}, "demo.nc");           // the program
//   write(553, {0x120101, 0x105}, u32(3));              // state ready: select it
//   write(553, {0x120101, 0x105}, u32(4));              // state active: start it
#pragma once

#include <utility>

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Execution mode and block search: see below. 0x104 mode, 0x105 state, 0x108 parameter:
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

// Commands with two objects: one to write, one to read the written value.

/// Adds `both` twice: with its name and _w as write-only, and with _r as read-only.
inline void add_pair(ObjectTable& table, std::uint32_t write_at, std::uint32_t read_at,
                     const Object& both) {
  Object command = both;
  command.name += "_w";
  command.read = {};
  Object answer = both;
  answer.name += "_r";
  answer.write = {};
  table.add(write_at, std::move(command));
  table.add(read_at, std::move(answer));
}

// The execution mode of a channel, and block search: a started NC program moves no axis before a
// certain block.
//
//   write(553, {0x120101, 0x3F}, u32(1));     // execution mode block search
//   write(553, {0x120101, 0x49}, u16(4));     // for a block number
//   write(553, {0x120101, 0x5F}, u32(120));   // N120

/// 0x3F to 0x41 execution mode (IB/tf5264_conveyor_tracking/1174455947, documented): 0 normal and 1
/// block search are simulated. 0x5F and 0x77 block number (IB/tf5200_blocksearch/348552331,
/// documented). 0x49 and 0x61 type of the search: 0 none, 4 a block number, as in an open-source
/// client of real controllers. Other values are not simulated and fail with invalid_data.
void add_block_search(ObjectTable& table);

}  // namespace millrace::cnc::simulator::objects
