// The tables of objects: each function adds its objects to a group's table.
//
//   write(553, {0x120101, 0x104}, u32(2));              // mode automatic
//   write(553, {0x120101, 0x108}, "demo.nc");           // the program
//   write(553, {0x120101, 0x105}, u32(3));              // state ready: select it
//   write(553, {0x120101, 0x105}, u32(4));              // state active: start it
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

// The commands of a channel under the COM task (port 553): execution mode; selection, start and
// reset of NC programs.

/// 0x104 mode, 0x105 state, 0x108 parameter: these offsets come from an early version of an
/// open-source client, and no page confirms them (our choice); the documented way to command them
/// is the PLC. 0x1 and 0x3 single block. 0x9, 0xA and 0xC feed override (in 0.1 %, up to 200 %; the
/// unit is inferred). 0x90 a packet for the streaming program (IB/tf5200_data_streaming/222591499,
/// documented; the offset from that client).
///
/// mc_block_count_r, the feedrates (in µm/s), mc_command_block_ignore (levels from the next start
/// on) and mc_command_M01_stop_enable have the names that an open-source client of real controllers
/// reads, at offsets of our choice. A command that cannot be executed fails with invalid_data, and
/// the operator gets the reason.
///
/// Block search: a started NC program moves no axis before a certain block. 0x3F to 0x41 execution
/// mode (IB/tf5264_conveyor_tracking/1174455947, documented): 0 normal and 1 block search are
/// simulated. 0x5F and 0x77 block number (IB/tf5200_blocksearch/348552331, documented). 0x49 and
/// 0x61 type of the search: 0 none, 4 a block number, as in an open-source client of real
/// controllers. Other values are not simulated and fail with invalid_data.
void add_commands(ObjectTable& table);

// The object directory of the COM task: the objects and their addresses
// (IB/tf5200_ads_access_to_cnc/855973643, documented).
//
//   read(553, {0x130101, 0}, 4);             // UNS32: number of objects in channel 1's directory
//   read(553, {0x130101, 1}, 2 * 84);        // the records of the first two

/// Adds to `table` the list of the objects of the CNC and of those of one channel, which are the
/// same for all. The directory of channel 0 has those of the CNC and of all channels; that of
/// channel 1 has those of the CNC and its own (documented); any other has its own. Offset 0 is the
/// number of records. Offset n is the records from n on, as many as fit into the client's buffer.
void add_directory(ObjectTable& table, const ObjectTable& cnc, const ObjectTable& channel);

// The old functions for the variables of a channel, 0x27 to 0x3F of its decoder, by index and by
// name (ISG/312784267 V.E., IB/hmiviaads/15685580171 V.A., ISG/312783243 V.G., documented). They
// cannot carry the strings of the Service Interface: a value has 24 bytes.

/// V.E., 0x27 to 0x30. A scalar has dimension 0. The memory place is GLOBAL or CHANNEL, the address
/// is the offset of the first byte there (our choice: only the types are documented). 0x2F takes
/// the name with an index.
void add_old_external_variables(ObjectTable& table);

/// V.A., 0x31 to 0x38. Names by index have no axis, names in accesses have one.
void add_old_axis_variables(ObjectTable& table);

/// V.G., 0x39 to 0x3F. The name of an array ends with its largest index.
void add_old_global_variables(ObjectTable& table);

/// The axes of the channel, 0x35 and 0x36.
void add_axis_names(ObjectTable& table);

/// P, V.L, V.P and V.S as REAL64: 0x02 to 0x05 counts, 0x1B to 0x26 names and values
/// (IB/hmiviaads/15685577611, 15685587851, 15685590411, 15685592971, documented). A string or a
/// whole array fails with invalid_data there (our choice).
void add_old_program_variables(ObjectTable& table);

// The generic functions for the variables of a channel, 0x44 to 0x4C of its decoder: the
// recommended access for clients (ISG/312788363, ISG/312791435, documented). They access the
// variables that NC programs create (P, V.P, V.L, V.S, V.CYC) by name only.

/// A stream longer than 2048 bytes or a name longer than 255 characters fails with invalid_size. An
/// input that cannot be decoded, or an unknown index or kind, fails with invalid_data (0x706,
/// invalid data, ISG/402275851, documented; when the kernel uses it is our choice).
void add_generic_variables(ObjectTable& table);

/// A variable as an object that is read and written without a stream; the whole offset is its
/// handle.
Object variable_by_handle();

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
