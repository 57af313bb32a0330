// Which variables a channel has, by family.
//
//   auto found = co_await list(channel, "V.G");
//   auto what = co_await find(channel, "V.G.SERVICE.UUID");
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "cnc/variables/channel.hpp"

namespace millrace::cnc::variables {

/// The families that can be listed: what the kernel, its configuration and its axes have, then what
/// programs have. V.CYC variables are read by name only (ISG/312791435.html, documented).
inline constexpr std::array<std::string_view, 7> families{"V.G", "V.E", "V.A", "P",
                                                          "V.P", "V.L", "V.S"};

/// The family of a variable, "V.G" of "V.G.SERVICE.UUID"; nothing for a name that begins with none
/// of them.
std::string_view family_of(std::string_view name);

/// "V.E.TABLE" of "V.E.TABLE[1]".
std::string_view without_indices(std::string_view name);

/// All variables of one of the families, with their names. What programs have comes from the old
/// functions: all of it REAL64 and READ_WRITE, an array by the name of its last element
/// (documented, addresses.hpp). An error is the controller's or the client's.
boost::asio::awaitable<ads::Result<std::vector<Description>>> list(Channel& channel,
                                                                   std::string_view family);

/// What a variable is. Asked by its name, without an index; where the controller is too old for
/// that, looked up in the list of its family. symbol_not_found if it is in none.
boost::asio::awaitable<ads::Result<Description>> find(Channel& channel, std::string name);

}  // namespace millrace::cnc::variables
