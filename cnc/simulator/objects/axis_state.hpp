// The objects of single axes: under COM (port 553) as an axis of the CNC and as an axis of its
// channel; under GEO (port 551) the speed that the position controller measures.
//
//   read(553, {0x120200, 0x20003}, 4);    // actual position of logical axis 2, SGN32 in 0.1 um
//   read(553, {0x120101, 0x20007}, 4);    // the same of the second axis of channel 1
//
// Groups and offsets of COM are those that an open-source client of real controllers reads; its
// names follow IB/tf5200_hli_interface/174749195. That page documents 0.1 um as the unit of
// positions.
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// 0x120200, offset 0x10000 * logical axis number.
void add_axes(ObjectTable& table);

/// 0x120100 + channel, offset 0x10000 * number in the channel.
void add_channel_axes(ObjectTable& table);

/// 0x120300, offset 0x10000 * logical axis number: 0xD the speed as SGN32, 0x250 as SGN64 (IB
/// 1031/tf5200_improved_pos_ctrl/1258252939, documented; the unit is our choice).
void add_position_controller(ObjectTable& table);

}  // namespace millrace::cnc::simulator::objects
