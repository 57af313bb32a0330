// Reads MCAP's serialised values from the front of a buffer, and remembers a premature end.
//
//   Cursor in(body, offset_of_body_in_file);
//   schema.id = in.u16();
//   schema.name = in.text();
//   if (!in.ok()) return in.problem("Schema");     // values read since are zero or empty
#pragma once

#include <cstdint>
#include <string>

#include "tools/mcap/records.hpp"

namespace millrace::tools::mcap {

class Cursor {
 public:
  /// `offset` is the place of `bytes` in the file, for messages only.
  explicit Cursor(Bytes bytes, std::uint64_t offset = 0) : rest_(bytes), offset_(offset) {}

  std::uint8_t u8() { return static_cast<std::uint8_t>(integer(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(integer(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(integer(4)); }
  std::uint64_t u64() { return integer(8); }

  Bytes take(std::uint64_t size) {
    if (size > rest_.size()) {
      ok_ = false;
      rest_ = {};
      return {};
    }
    const Bytes taken = rest_.substr(0, static_cast<std::size_t>(size));
    rest_.remove_prefix(taken.size());
    offset_ += taken.size();
    return taken;
  }

  /// Bytes with their length before them, 32 bits.
  Bytes sized() { return take(u32()); }
  std::string text() { return std::string(sized()); }

  [[nodiscard]] Bytes rest() const { return rest_; }
  [[nodiscard]] bool empty() const { return rest_.empty(); }
  [[nodiscard]] bool ok() const { return ok_; }
  /// Place in the file of the next byte, or of the value that was cut.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }

  /// An array or map after its length in bytes: only its elements.
  Cursor nested() {
    const Bytes inner = sized();
    Cursor result(inner, offset_ - inner.size());
    result.ok_ = ok_;
    return result;
  }
  /// Counts a mistake inside a nested cursor as one of this.
  void check(const Cursor& inner) {
    if (ok_ && !inner.ok_) {
      ok_ = false;
      offset_ = inner.offset_;
    }
  }

  [[nodiscard]] tl::unexpected<Problem> problem(const std::string& record) const {
    return mcap::problem(offset_, "the " + record + " record ends inside one of its fields");
  }

 private:
  std::uint64_t integer(std::size_t size) {
    std::uint64_t value = 0;
    const Bytes bytes = take(size);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      value |= std::uint64_t{static_cast<std::uint8_t>(bytes[i])} << (8 * i);
    }
    return value;
  }

  Bytes rest_;
  std::uint64_t offset_;
  bool ok_ = true;
};

}  // namespace millrace::tools::mcap
