// The arithmetic of the sample service in the vendor's manual
// (IB/tf5200_service_interface/356533387): a number in, its square root out. Pure.
#pragma once

#include <string>
#include <string_view>

#include "services/sdk/response.hpp"

namespace millrace::services::square_root {

/// State of an answer that is a root.
inline constexpr std::uint32_t state_ok = 1;
/// State of an answer that says why there is none.
inline constexpr std::uint32_t state_error = 99;

/// Documented: the root as "%f" prints it with state 1; for a negative number "ERROR: cannot calc
/// square root of negative number %f" with state 99. Our choice: the whole request must be a
/// decimal number, blanks around it do not count; anything else gets an error text with state 99. A
/// number that "%f" prints with more than 127 bytes is printed as "%e".
sdk::Response square_root(std::string_view request);

}  // namespace millrace::services::square_root
