// Foreign user_data: what parses can be announced, and reads the same after it was written again.
#include <cassert>
#include <cstdint>
#include <string_view>

#include "fabric/identity.hpp"
#include "fabric/identity_text.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace millrace::fabric;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  parse_instance(text);
  if (const auto identity = parse_identity(text)) {
    assert(!check_identity(*identity));
    assert(parse_identity(format_identity(*identity)) == *identity);
  }
  return 0;
}
