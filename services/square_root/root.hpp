// The arithmetic of the sample service in the vendor's manual
// (IB/tf5200_service_interface/356533387): the square root of a number. Pure.
#pragma once

#include <string_view>

#include "services/sdk/response.hpp"

namespace millrace::services::square_root {

/// State of a response with a root.
inline constexpr std::uint32_t state_ok = 1;
/// State of a response with an error.
inline constexpr std::uint32_t state_error = 99;

/// Documented: the root as "%f" prints it with state 1; for a negative number "ERROR: cannot calc
/// square root of negative number %f" with state 99. Our choice: the whole request must be a
/// decimal number, surrounding blanks are ignored; any other text gets an error text with state 99.
/// A number that "%f" prints with more than 127 bytes is printed as "%e".
sdk::Response square_root(std::string_view request);

}  // namespace millrace::services::square_root
