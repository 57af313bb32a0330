// The streams in which variables travel: what is understood is encoded to a stream that means the
// same.
#include <cstdlib>

#include "cnc/variables/layout.hpp"
#include "cnc/variables/service_value.hpp"

namespace {

using namespace millrace::cnc::variables;

void require(bool condition) {
  if (!condition) {
    std::abort();
  }
}

void streams(BytesView input) {
  if (const auto description = decode_description(input)) {
    const auto again = encode(*description, NameInDescription::yes);
    require(decode_description(again) == description);
  }
  if (const auto stream = decode_handle_stream(input)) {
    const auto again = encode(stream->element, stream->value);
    require(decode_handle_stream(again)->element == stream->element);
  }
  if (const auto stream = decode_name(input)) {
    const auto again = encode_name(stream->name, stream->value);
    require(decode_name(again)->name == stream->name);
  }
  if (const auto stream = decode_index_stream(input)) {
    const auto again = encode(*stream);
    require(decode_index_stream(again)->kind == stream->kind);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const BytesView input(data, size);
  streams(input);
  for (const auto variable : all_service_variables) {
    const auto value = decode_value(variable, input);
    if (value && (is_state(variable) || std::get<std::string>(*value).size() <= 127)) {
      require(decode_value(variable, *encode_value(variable, *value)) == value);
    }
  }
  return 0;
}
