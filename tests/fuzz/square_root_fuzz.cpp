// For any request of an NC program, the answer fits and is a root or an error.
#include <cassert>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "fabric/messages.hpp"
#include "services/square_root/root.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace millrace::services::square_root;
  const auto response = square_root({reinterpret_cast<const char*>(data), size});
  assert(response.text.size() <= millrace::fabric::max_text);
  assert(response.state == state_ok || response.state == state_error);
  assert(response.text.starts_with("ERROR: ") == (response.state == state_error));
  if (response.state == state_ok) {
    char* end = nullptr;
    assert(std::strtod(response.text.c_str(), &end) >= 0);
    assert(*end == '\0');
  }
  return 0;
}
