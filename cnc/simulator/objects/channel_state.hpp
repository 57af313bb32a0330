// The objects of the GEO task (port 551) for a channel that runs an NC program. The offsets are
// those of an open-source client of real controllers; the vendor's pages have only 0x1A and 0x56 of
// them.
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

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

}  // namespace millrace::cnc::simulator::objects
