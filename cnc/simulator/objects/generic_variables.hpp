// The generic functions for the variables of a channel, 0x44 to 0x4C of its decoder: what a client
// should use (ISG/312788363, ISG/312791435, documented).
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Every stream longer than 2048 bytes and every name longer than 255 characters is refused with
/// invalid_size; what cannot be decoded, an index or a kind that does not exist with invalid_data
/// (0x706, invalid data, ISG/402275851, documented; when the kernel uses it is our choice).
void add_generic_variables(ObjectTable& table);

/// A variable as an object that is read and written without a stream; the whole offset is its
/// handle.
Object variable_by_handle();

}  // namespace millrace::cnc::simulator::objects
