// The streams that transfer variables: what parses is encoded to a stream with the same meaning.
// And the records of COM's directory: those that parse fit into a response.
#include <cstdlib>

#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"
#include "cnc/variables/objects.hpp"
#include "cnc/variables/service_variable.hpp"

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

void records(BytesView input) {
  const auto entry = decode_directory_record(input);
  require(entry.has_value() == (input.size() >= directory_record));
  if (!entry) {
    return;
  }
  require(entry->name.size() <= 32 && entry->type.size() <= 32);
  if (const auto type = element_type(*entry)) {
    require(type->size > 0 && type->size <= max_stream);
    static_cast<void>(decode_elements(*type, input));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const BytesView input(data, size);
  streams(input);
  records(input);
  for (const auto variable : all_service_variables) {
    const auto value = decode_value(variable, input);
    if (value && (is_state(variable) || std::get<std::string>(*value).size() <= 127)) {
      require(decode_value(variable, *encode_value(variable, *value)) == value);
    }
  }
  return 0;
}
