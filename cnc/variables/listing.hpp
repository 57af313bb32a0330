// Which variables a channel has, by family.
//
//   auto found = co_await list(channel, "V.G");
//   auto what = co_await find(channel, "V.G.SERVICE.UUID");
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "cnc/variables/channel.hpp"
#include "cnc/variables/family.hpp"

namespace millrace::cnc::variables {

/// The old functions that list the variables of programs (addresses.hpp).
struct OldListing {
  std::string_view family;
  std::uint32_t count = 0;
  std::uint32_t name = 0;
};
/// Those of a family; null if it is listed otherwise.
const OldListing* old_listing(std::string_view family);
/// What is known of a variable that they name, an array with its largest index: what the controller
/// answers when it is asked for the name without that; where it is too old, REAL64 and READ_WRITE
/// (documented for the old functions).
Description old_description(std::string name, ads::Result<Description> described);

/// All variables of one of the families, with their names. The names of what programs have come
/// from the old functions (addresses.hpp), and what each is, old_description tells. An error is the
/// controller's or the client's.
boost::asio::awaitable<ads::Result<std::vector<Description>>> list(Channel& channel,
                                                                   std::string_view family);

/// What a variable is. Asked by its name, without an index; where the controller is too old for
/// that, looked up in the list of its family. symbol_not_found if it is in none.
boost::asio::awaitable<ads::Result<Description>> find(Channel& channel, std::string name);

}  // namespace millrace::cnc::variables
