// Objects that show the state of the CNC, of its channels and of its axes.
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

// The objects of the COM task for the whole CNC. A client finds them by their names in the object
// directory. Names and types are those that an open-source client of real controllers reads; the
// addresses are our choice.

/// Cycle counter and cycle time (in µs), version, numbers of channels and axes.
void add_platform(ObjectTable& table);

// The objects of the GEO task (port 551) for a channel that runs an NC program. The offsets are
// those of an open-source client of real controllers; the vendor's pages have only 0x1A and 0x56 of
// them.

/// Group of the channel's state: 0x1F state, 0x20 mode (values: IB/tf5200_hli_interface/174845451
/// and 174850187, documented).
void add_channel_state(ObjectTable& table);

/// Group of the interpolator: 0x1 number of axes, 0x8 remaining path of the block, 0x15 velocity,
/// 0x21 number of the executed block, 0x22 remaining dwell time, 0x2E number of blocks, 0x56 path
/// since the start of the NC program. Units: attribute 0x400 (our choice, except µm/s: open-source
/// client).
void add_interpolator_state(ObjectTable& table);

/// The AEP parameters of the configuration. Documented: GEO has their number, their names by index
/// and their values by index and by name, as SDA has those of P parameters; a client finds the
/// functions by name, since addresses change (IB/hmiviaads/15685576075, 15685595531). The
/// functions' names and addresses are not documented: ours follow those of the P parameters.
void add_aep_parameters(ObjectTable& table);

// The objects of single axes: under COM (port 553) as an axis of the CNC and as an axis of its
// channel; under GEO (port 551) the speed that the position controller measures.
//
//   read(553, {0x120200, 0x20003}, 4);    // actual position of logical axis 2, SGN32 in 0.1 um
//   read(553, {0x120101, 0x20007}, 4);    // the same of the second axis of channel 1
//
// Groups and offsets of COM are those that an open-source client of real controllers reads; its
// names follow IB/tf5200_hli_interface/174749195. That page documents 0.1 um as the unit of
// positions.

/// 0x120200, offset 0x10000 * logical axis number.
void add_axes(ObjectTable& table);

/// 0x120100 + channel, offset 0x10000 * number in the channel.
void add_channel_axes(ObjectTable& table);

/// 0x120300, offset 0x10000 * logical axis number: 0xD the speed as SGN32, 0x250 as SGN64 (IB
/// 1031/tf5200_improved_pos_ctrl/1258252939, documented; the unit is our choice).
void add_position_controller(ObjectTable& table);

// The functions for V.A. variables of one axis, 4 to 6 of the decoder. The upper half of the offset
// is the number of the channel's axis: 0x10005 reads a variable of the first axis
// (IB/tf5200_ads_access_to_cnc/312807307, 312808843, 312810379, documented).

/// Names have no axis: "V.A.WCS".
void add_axis_functions(ObjectTable& table);

}  // namespace millrace::cnc::simulator::objects
