// Foreign user_data: what parses can be announced, and parses the same after it is written again.
#include <cassert>
#include <cstdint>
#include <string_view>

#include "fabric/participant_identity.hpp"
#include "fabric/process_version.hpp"
#include "fabric/registry/identity.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace millrace::fabric;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  registry::parse_instance(text);
  if (const auto identity = registry::parse_identity(text)) {
    assert(!registry::check_identity(*identity));
    assert(registry::parse_identity(registry::format_identity(*identity)) == *identity);
  }
  if (const auto process = parse_process_version(text)) {
    assert(parse_process_version(format_process_version(*process)) == *process);
  }
  if (const auto where = parse_process_info(text)) {
    assert(parse_process_info(format_process_info(*where)) == *where);
  }
  return 0;
}
