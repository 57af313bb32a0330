// What the GEO task (port 551) tells about a channel while a program runs. The offsets are those an
// open-source client of real controllers uses; only 0x1A and 0x56 of them are in the vendor's
// pages.
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Group of the channel's state: 0x1F state, 0x20 mode (values: IB/tf5200_hli_interface/174845451
/// and 174850187, documented).
void add_channel_state(ObjectTable& table);

/// Group of the interpolator: 0x1 number of axes, 0x8 rest of the path in the block, 0x15 velocity,
/// 0x21 number of the block in execution, 0x22 rest of a dwell, 0x2E number of blocks and 0x56 path
/// since the program's start. Units: attribute 0x400 (our choice, except µm/s: open-source client).
void add_interpolator_state(ObjectTable& table);

/// The AEP parameters of the configuration. Documented is that GEO has their number, their names by
/// index and their values by index and by name, as SDA has those of P parameters, and that a client
/// looks the functions up by name, since addresses change (IB/hmiviaads/15685576075, 15685595531).
/// Names and addresses are not: ours follow those of the P parameters.
void add_aep_parameters(ObjectTable& table);

}  // namespace millrace::cnc::simulator::objects
