// Reads and writes integers in byte buffers with bounds checks, little-endian by default.
//
//   ByteReader in(payload);
//   auto group = in.u32();
//   auto data = in.take(in.u32());
//   if (!in.ok()) …                       // bytes were missing; all values read since are 0
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace millrace::base {

using Bytes = std::vector<std::uint8_t>;
using BytesView = std::span<const std::uint8_t>;

/// The text up to the first NUL or the end.
inline std::string_view text_in(BytesView bytes) {
  const auto end = std::find(bytes.begin(), bytes.end(), std::uint8_t{0});
  return {reinterpret_cast<const char*>(bytes.data()),
          static_cast<std::size_t>(end - bytes.begin())};
}

/// Reads from the front. A read beyond the end yields zero or an empty view and makes ok() false
/// permanently.
class ByteReader {
 public:
  explicit ByteReader(BytesView bytes, std::endian order = std::endian::little)
      : rest_(bytes), order_(order) {}

  std::uint8_t u8() { return static_cast<std::uint8_t>(integer(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(integer(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(integer(4)); }
  std::uint64_t u64() { return integer(8); }
  /// Of `size` bytes, at most 8.
  std::uint64_t integer(std::size_t size) {
    std::uint64_t value = 0;
    const auto bytes = take(size);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      const std::size_t place = order_ == std::endian::little ? i : size - 1 - i;
      value |= std::uint64_t{bytes[i]} << (8 * place);
    }
    return value;
  }
  /// The next `size` bytes, as a view into the buffer.
  BytesView take(std::size_t size) {
    if (size > rest_.size()) {
      ok_ = false;
      rest_ = {};
      return {};
    }
    const auto taken = rest_.first(size);
    rest_ = rest_.subspan(size);
    return taken;
  }
  /// The remaining bytes, without consuming them.
  [[nodiscard]] BytesView rest() const { return rest_; }
  [[nodiscard]] bool ok() const { return ok_; }
  /// No byte was missing and none is left.
  [[nodiscard]] bool exact() const { return ok_ && rest_.empty(); }

 private:
  BytesView rest_;
  std::endian order_;
  bool ok_ = true;
};

/// Appends to its own buffer; the calls chain.
class ByteWriter {
 public:
  ByteWriter& u8(std::uint8_t value) { return integer(value, 1); }
  ByteWriter& u16(std::uint16_t value) { return integer(value, 2); }
  ByteWriter& u32(std::uint32_t value) { return integer(value, 4); }
  ByteWriter& u64(std::uint64_t value) { return integer(value, 8); }
  ByteWriter& bytes(BytesView data) {
    out_.insert(out_.end(), data.begin(), data.end());
    return *this;
  }
  ByteWriter& text(std::string_view text) {
    out_.insert(out_.end(), text.begin(), text.end());
    return *this;
  }
  ByteWriter& zeros(std::size_t count) {
    out_.insert(out_.end(), count, 0);
    return *this;
  }
  void reserve(std::size_t size) { out_.reserve(size); }
  /// Moves the buffer out and leaves the writer empty.
  [[nodiscard]] Bytes take() { return std::move(out_); }
  [[nodiscard]] std::size_t size() const { return out_.size(); }

 private:
  ByteWriter& integer(std::uint64_t value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) {
      out_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    }
    return *this;
  }

  Bytes out_;
};

}  // namespace millrace::base
