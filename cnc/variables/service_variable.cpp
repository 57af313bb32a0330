#include "cnc/variables/service_variable.hpp"

#include <cassert>

#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {

ads::Result<ServiceValue> decode_value(ServiceVariable variable, ads::BytesView bytes) {
  if (!is_state(variable)) {
    return decode_text(bytes);
  }
  ads::ByteReader in(bytes);
  const auto state = in.u32();
  if (!in.exact()) {
    return tl::make_unexpected(ads::ErrorCode::protocol_error);
  }
  return state;
}

ads::Result<ads::Bytes> encode_value(ServiceVariable variable, const ServiceValue& value) {
  assert(is_state(variable) == std::holds_alternative<std::uint32_t>(value));
  if (is_state(variable)) {
    ads::ByteWriter out;
    return out.u32(std::get<std::uint32_t>(value)).take();
  }
  auto text = encode_text(std::get<std::string>(value));
  if (!text) {
    return tl::make_unexpected(ads::ErrorCode::invalid_size);
  }
  return std::move(*text);
}

}  // namespace millrace::cnc::variables
