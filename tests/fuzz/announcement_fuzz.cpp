// Foreign multicast packets.
#include <cstdint>

#include "tools/doctor/announcement.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static_cast<void>(millrace::tools::doctor::parse_announcement({data, size}));
  return 0;
}
