#include "cnc/variables/service_variable.hpp"

#include <cassert>

#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {

ads::Result<ServiceValue> decode_value(ServiceVariable variable, ads::BytesView bytes) {
  if (!is_state(variable)) {
    return decode_text(bytes);
  }
  return decode_number(bytes);
}

ads::Result<ads::Bytes> encode_value(ServiceVariable variable, const ServiceValue& value) {
  assert(is_state(variable) == std::holds_alternative<std::uint32_t>(value));
  if (is_state(variable)) {
    return ads::ByteWriter().u32(std::get<std::uint32_t>(value)).take();
  }
  auto text = encode_text(std::get<std::string>(value));
  if (!text) {
    return tl::make_unexpected(ads::ErrorCode::invalid_size);
  }
  return std::move(*text);
}

}  // namespace millrace::cnc::variables
