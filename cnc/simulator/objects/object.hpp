// One object that ADS clients address by index group and offset: its operations and its attributes.
//
//   table.add(0x20, {.name = "mode", .type = "UNS32", .length = 4,
//                    .read = [](const Context& at) { return … }});
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "cnc/ads/bytes.hpp"
#include "cnc/ads/device.hpp"
#include "cnc/simulator/machine.hpp"

namespace millrace::cnc::simulator::objects {

/// How an object was addressed.
struct Context {
  Machine& machine;
  /// The channel in the index group; null for an object of the whole CNC.
  VirtualChannel* channel = nullptr;
  /// The upper half of the index offset: the number of an axis, from 1, in the channel, or in the
  /// CNC if there is no channel; 0 = no axis.
  std::uint32_t axis = 0;
  /// The lower half of the index offset.
  std::uint32_t offset = 0;
  /// Size of the client's buffer in bytes; a client may send any number.
  std::uint32_t room = 0;
};

/// An empty operation fails with access_denied_index (0x704 not readable or not writable,
/// ISG/402275851, documented).
struct Object {
  using Read = std::function<ads::Result<ads::Bytes>(const Context&)>;
  using Write = std::function<ads::Result<void>(const Context&, ads::BytesView)>;
  using Exchange = std::function<ads::Result<ads::Bytes>(const Context&, ads::BytesView)>;

  std::string name;
  /// For example "UNS32", or "DWORD" as the object directory names it.
  std::string type;
  /// In bytes; the maximum if it varies.
  std::uint32_t length = 0;
  /// Empty without a unit.
  std::string unit = {};
  Read read = {};
  Write write = {};
  /// ReadWrite.
  Exchange exchange = {};
};

/// An object of a number type, which determines its length.
Object object(std::string name, std::string type, std::string unit, Object::Read read,
              Object::Write write = {});

/// The objects of one kind of index group by the lower half of their offset.
class ObjectTable {
 public:
  /// The offset must be new in this table.
  void add(std::uint32_t offset, Object object);
  /// Handles every offset without an object of its own.
  void add_rest(Object object);
  /// Null if there is none.
  [[nodiscard]] const Object* find(std::uint32_t offset) const;
  [[nodiscard]] const std::map<std::uint32_t, Object>& all() const { return objects_; }

 private:
  std::map<std::uint32_t, Object> objects_;
  std::optional<Object> rest_;
};

// Helpers of many objects: decode small inputs, encode small responses.

/// Feeds are sent in µm/s.
inline constexpr double micrometres_per_mm = 1e3;

/// A number or an enumeration that fits.
template <typename Number>
ads::Bytes encode_u32(Number value) {
  return ads::ByteWriter().u32(static_cast<std::uint32_t>(value)).take();
}
template <typename Number>
ads::Bytes encode_u16(Number value) {
  return ads::ByteWriter().u16(static_cast<std::uint16_t>(value)).take();
}
/// SGN32; a number out of range becomes the nearest one in range.
ads::Bytes encode_s32(long value);
ads::Bytes encode_f64(double value);

/// The text in a buffer of `size` bytes, padded with zeros; invalid_size if it does not fit with
/// its NUL.
ads::Result<ads::Bytes> encode_buffer(std::string_view text, std::size_t size);

/// An input of exactly so many bytes; otherwise invalid_size.
ads::Result<std::uint16_t> decode_u16(ads::BytesView in);
ads::Result<std::uint32_t> decode_u32(ads::BytesView in);

/// The name at the front of an input; invalid_size if it is empty or longer than 255 characters.
ads::Result<std::string_view> decode_name(ads::BytesView in);

/// Finds a variable by name; otherwise the configured error for an unknown variable.
ads::Result<Selection> find_variable(const Context& at, std::string_view name);

}  // namespace millrace::cnc::simulator::objects
