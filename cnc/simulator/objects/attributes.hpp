// The attributes of an object: name, type, length, unit, and whether it can be written
// (IB/tf5200_ads_access_to_cnc/312767243, documented).
#pragma once

#include "cnc/simulator/objects/group.hpp"
#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Texts end with a NUL, the length is UNS32, writable is one byte (the kinds are documented, the
/// sizes are our choice). `attribute` is neither value nor address.
ads::Bytes attribute_of(const Object& object, Attribute attribute);

}  // namespace millrace::cnc::simulator::objects
