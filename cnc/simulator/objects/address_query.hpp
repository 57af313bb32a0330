// The query for the address of a channel's or an axis's objects: attribute 0x600 of a group, offset
// 0 (IB/hmiviaads/15685565323, documented).
#pragma once

#include "cnc/simulator/objects/group.hpp"
#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// ReadWrite: UNS32 channel and UNS32 axis in; UNS32 group and UNS32 offset out, both 0 for an
/// unknown channel or axis.
Object address_query(GroupKind kind);

}  // namespace millrace::cnc::simulator::objects
