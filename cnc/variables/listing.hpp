// Lists the variables of a channel by family.
//
//   auto found = co_await list(channel, "V.G");
//   auto what = co_await find(channel, "V.G.SERVICE.UUID");
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "cnc/variables/channel.hpp"
#include "cnc/variables/names.hpp"

namespace millrace::cnc::variables {

/// The offsets of the old functions that list the variables of NC programs (addresses.hpp).
struct OldListing {
  std::string_view family;
  std::uint32_t count = 0;
  std::uint32_t name = 0;
};
/// The functions of a family; null if it is listed in another way.
const OldListing* old_listing(std::string_view family);
/// The description of a variable from the old functions, whose name for an array has its largest
/// index. `described` is the controller's description of the name without that index. Controllers
/// that cannot describe by name give REAL64 and READ_WRITE (documented for the old functions).
Description old_description(std::string name, ads::Result<Description> described);

/// All variables of one of the families, with their names. The old functions (addresses.hpp) name
/// the variables of NC programs, and old_description() describes them. Errors are those of the
/// controller or the client.
boost::asio::awaitable<ads::Result<std::vector<Description>>> list(Channel& channel,
                                                                   std::string_view family);

/// The description of a variable. Requested by its name without an index; if the controller is too
/// old for that, searched in the list of its family. symbol_not_found if it is in none.
boost::asio::awaitable<ads::Result<Description>> find(Channel& channel, std::string name);

}  // namespace millrace::cnc::variables
