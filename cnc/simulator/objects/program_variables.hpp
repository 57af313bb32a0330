// ADS access to the variables that NC programs create: P, V.P, V.L, V.S, V.CYC.
//
// The generic functions access them by name only (ISG/312791435, documented). The old functions
// list P, V.L, V.P and V.S and read them as REAL64 (IB/hmiviaads/15685577611, 15685587851,
// 15685590411, 15685592971, documented).
#pragma once

#include <string_view>

#include "cnc/simulator/objects/object.hpp"
#include "cnc/variables/layout.hpp"

namespace millrace::cnc::simulator::objects {

/// True if a name begins with one of these families.
bool is_program_variable(std::string_view name);

// By name: an element or a whole array. A name that does not exist at present gets the error of an
// unknown variable; a value of the wrong size fails with invalid_size.
ads::Result<ads::Bytes> read_program_variable(const Context& at, std::string_view name);
ads::Result<void> write_program_variable(const Context& at, std::string_view name,
                                         ads::BytesView value);
/// The description has no handle (0).
ads::Result<variables::Description> describe_program_variable(const Context& at,
                                                              std::string_view name);

/// The old functions: 0x02 to 0x05 counts, 0x1B to 0x26 names and values. A string or a whole array
/// fails with invalid_data there (our choice).
void add_old_program_variables(ObjectTable& table);

// The generic functions for the variables of a channel, 0x44 to 0x4C of its decoder: the
// recommended access for clients (ISG/312788363, ISG/312791435, documented).

/// A stream longer than 2048 bytes or a name longer than 255 characters fails with invalid_size. An
/// input that cannot be decoded, or an unknown index or kind, fails with invalid_data (0x706,
/// invalid data, ISG/402275851, documented; when the kernel uses it is our choice).
void add_generic_variables(ObjectTable& table);

/// A variable as an object that is read and written without a stream; the whole offset is its
/// handle.
Object variable_by_handle();

}  // namespace millrace::cnc::simulator::objects
