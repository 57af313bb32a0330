// Helpers of many objects: decode small inputs, encode small responses.
#pragma once

#include <cstdint>
#include <string_view>

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// Feeds are sent in µm/s.
inline constexpr double micrometres_per_mm = 1e3;

ads::Bytes encode_u32(std::uint32_t value);
/// SGN32; a number out of range becomes the nearest one in range.
ads::Bytes encode_s32(long value);
ads::Bytes encode_f64(double value);

/// The text in a buffer of `size` bytes, padded with zeros; invalid_size if it does not fit with
/// its NUL.
ads::Result<ads::Bytes> encode_buffer(std::string_view text, std::size_t size);

/// An input of exactly four bytes; otherwise invalid_size.
ads::Result<std::uint32_t> decode_u32(ads::BytesView in);

/// The name at the front of an input; invalid_size if it is empty or longer than 255 characters.
ads::Result<std::string_view> decode_name(ads::BytesView in);

/// Finds a variable by name; otherwise the configured error for an unknown variable.
ads::Result<Selection> find_variable(const Context& at, std::string_view name);

}  // namespace millrace::cnc::simulator::objects
