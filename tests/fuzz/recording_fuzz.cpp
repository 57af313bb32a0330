// Foreign messages of a recording: an entry that was read, written and read again is the same.
#include <cassert>
#include <cstdint>
#include <string>
#include <string_view>

#include "tools/recording/codec.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace millrace::tools::recording;
  // The first line names the schema.
  const std::string_view input(reinterpret_cast<const char*>(data), size);
  const auto end = input.find('\n');
  if (end == std::string_view::npos) {
    return 0;
  }
  const std::string schema = "millrace.recording." + std::string(input.substr(0, end));
  if (const auto entry = decode(schema, input.substr(end + 1), {})) {
    const auto again = decode(schema, encode(*entry), {});
    assert(again && encode(*again) == encode(*entry));
  }
  return 0;
}
