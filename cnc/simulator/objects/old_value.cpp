#include "cnc/simulator/objects/old_value.hpp"

#include <algorithm>
#include <cassert>

namespace millrace::cnc::simulator::objects {

namespace {

using ads::BytesView;

/// Bytes of VAR_STRING in the union.
constexpr std::size_t text_size = old_text_characters + 1;

/// The characters and their NUL, or all bytes if there is no NUL.
BytesView text_in(BytesView bytes) {
  const auto nul = std::find(bytes.begin(), bytes.end(), std::uint8_t{0});
  const auto end = nul == bytes.end() ? nul : nul + 1;
  return bytes.first(static_cast<std::size_t>(end - bytes.begin()));
}

bool is_text(const Variable& variable) {
  return variable.declaration().element.type == Type::string;
}

}  // namespace

ads::Result<ads::Bytes> read_old_value(const Variable& variable, std::uint32_t element) {
  ads::Bytes bytes = variable.bytes(element);
  if (is_text(variable)) {
    bytes.resize(text_in(bytes).size());
    if (bytes.size() > text_size) {
      return tl::unexpected(ads::ErrorCode::invalid_size);
    }
  }
  bytes.resize(old_value_size, 0);
  return bytes;
}

ads::Result<void> write_old_value(Variable& variable, std::uint32_t element, BytesView value) {
  assert(value.size() == old_value_size);
  if (is_text(variable)) {
    return variable.write(element, text_in(value.first(text_size)));
  }
  return variable.write(element, value.first(variable.declaration().element.size));
}

}  // namespace millrace::cnc::simulator::objects
