// The generic functions for the variables of a channel, 0x44 to 0x4C of its decoder: the
// recommended access for clients (ISG/312788363, ISG/312791435, documented).
#pragma once

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// A stream longer than 2048 bytes or a name longer than 255 characters fails with invalid_size. An
/// input that cannot be decoded, or an unknown index or kind, fails with invalid_data (0x706,
/// invalid data, ISG/402275851, documented; when the kernel uses it is our choice).
void add_generic_variables(ObjectTable& table);

/// A variable as an object that is read and written without a stream; the whole offset is its
/// handle.
Object variable_by_handle();

}  // namespace millrace::cnc::simulator::objects
