// Records to bytes and back. The fields of a record in a file are the members of its struct, in
// their order.
//
//   append(out, schema);                            // one whole record, prefix included
//   Cursor in(content, offset_of_content_in_file);
//   auto schema = decode<Schema>(in);
#pragma once

#include <concepts>
#include <cstdint>
#include <string>
#include <utility>

#include <boost/pfr/core.hpp>

#include "base/bytes.hpp"
#include "tools/mcap/records.hpp"

namespace millrace::tools::mcap {

/// Reads MCAP's serialised values from the front of a buffer, and remembers a premature end: values
/// read since are zero or empty.
class Cursor {
 public:
  /// `offset` is the place of `bytes` in the file, for messages only.
  explicit Cursor(Bytes bytes, std::uint64_t offset = 0)
      : in_({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}), offset_(offset) {}

  /// Of `size` bytes, little endian.
  std::uint64_t integer(std::size_t size) {
    const std::uint64_t value = in_.integer(size);
    offset_ += in_.ok() ? size : 0;
    return value;
  }
  std::uint8_t u8() { return static_cast<std::uint8_t>(integer(1)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(integer(4)); }
  std::uint64_t u64() { return integer(8); }

  Bytes take(std::uint64_t size) {
    const Bytes taken = view(in_.take(size));
    offset_ += taken.size();
    return taken;
  }

  /// Bytes with their length before them, 32 bits.
  Bytes sized() { return take(u32()); }
  std::string text() { return std::string(sized()); }

  [[nodiscard]] Bytes rest() const { return view(in_.rest()); }
  [[nodiscard]] bool empty() const { return in_.rest().empty(); }
  [[nodiscard]] bool ok() const { return ok_ && in_.ok(); }
  /// Place in the file of the next byte, or of the value that was cut.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }

  /// An array or map after its length in bytes: only its elements.
  Cursor nested() {
    const Bytes inner = sized();
    return Cursor(inner, offset_ - inner.size());
  }
  /// Counts a mistake inside a nested cursor as one of this.
  void check(const Cursor& inner) {
    if (ok() && !inner.ok()) {
      ok_ = false;
      offset_ = inner.offset_;
    }
  }

  [[nodiscard]] tl::unexpected<Problem> problem(const std::string& record) const {
    return mcap::problem(offset_, "the " + record + " record ends inside one of its fields");
  }

 private:
  static Bytes view(base::BytesView bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

  base::ByteReader in_;
  std::uint64_t offset_;
  /// No nested one had a mistake.
  bool ok_ = true;
};

namespace detail {

// Integers are little endian. Texts have their length before them, maps and lists their length in
// bytes, both with 32 bits; bulk data have 64 bits, but those of a message end with its record.

template <std::unsigned_integral Integer>
void put(std::string& out, const Integer& value) {
  for (std::size_t i = 0; i < sizeof value; ++i) {
    out.push_back(static_cast<char>(value >> (8 * i)));
  }
}
inline void put(std::string& out, Opcode opcode) {
  out.push_back(static_cast<char>(opcode));
}
inline void put(std::string& out, const std::string& text) {
  put(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}
template <typename Pairs>
void put(std::string& out, const Pairs& pairs) {
  std::string elements;
  for (const auto& [first, second] : pairs) {
    put(elements, first);
    put(elements, second);
  }
  put(out, elements);
}

template <std::unsigned_integral Integer>
void take(Cursor& in, Integer& value) {
  value = static_cast<Integer>(in.integer(sizeof value));
}
inline void take(Cursor& in, Opcode& opcode) {
  opcode = Opcode{in.u8()};
}
inline void take(Cursor& in, std::string& text) {
  text = in.text();
}
template <typename First, typename Second>
void add(std::map<First, Second>& map, First first, Second second) {
  map.insert_or_assign(std::move(first), std::move(second));
}
template <typename First, typename Second>
void add(std::vector<std::pair<First, Second>>& list, First first, Second second) {
  list.emplace_back(std::move(first), std::move(second));
}
template <typename Pairs>
void take(Cursor& in, Pairs& pairs) {
  Cursor elements = in.nested();
  while (elements.ok() && !elements.empty()) {
    std::remove_const_t<typename Pairs::value_type::first_type> first{};
    typename Pairs::value_type::second_type second{};
    take(elements, first);
    take(elements, second);
    add(pairs, std::move(first), std::move(second));
  }
  in.check(elements);
}

}  // namespace detail

/// An attachment with its CRC.
template <typename Record>
void append(std::string& out, const Record& record) {
  detail::put(out, Record::opcode);
  const std::size_t length_at = out.size();
  detail::put(out, std::uint64_t{0});
  const std::size_t begin = out.size();
  boost::pfr::for_each_field(record, [&](const auto& field) {
    if constexpr (!std::is_same_v<std::remove_cvref_t<decltype(field)>, Bytes>) {
      detail::put(out, field);
    } else {
      if constexpr (!std::is_same_v<Record, Message>) {
        detail::put(out, std::uint64_t{field.size()});
      }
      out += field;
    }
  });
  if constexpr (std::is_same_v<Record, Attachment>) {
    detail::put(out, crc32(Bytes(out).substr(begin)));
  }
  std::string length;
  detail::put(length, std::uint64_t{out.size() - begin});
  out.replace(length_at, length.size(), length);
}

/// The footer's CRC is computed from `crc_before`, the checksum of the summary up to here.
inline void append_footer(std::string& out, Footer footer, std::uint32_t crc_before) {
  std::string bytes;
  append(bytes, footer);
  footer.summary_crc =
      crc32(Bytes(bytes).substr(0, bytes.size() - sizeof footer.summary_crc), crc_before);
  append(out, footer);
}

/// Takes the fields of a record from its content, without its prefix. Bulk data of the result are
/// views into the cursor's bytes. A schema of id 0 is a problem, too, and so is an attachment with
/// a wrong CRC. Fields that a later version of the format may have added at the end are left in the
/// cursor.
template <typename Record>
Expected<Record> decode(Cursor& in) {
  const std::uint64_t offset = in.offset();
  [[maybe_unused]] const Bytes content = in.rest();
  Record record;
  boost::pfr::for_each_field(record, [&](auto& field) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(field)>, Bytes>) {
      field = in.take(std::is_same_v<Record, Message> ? in.rest().size() : in.u64());
    } else {
      detail::take(in, field);
    }
  });
  if constexpr (std::is_same_v<Record, Schema>) {
    if (in.ok() && record.id == 0) {
      return problem(offset, "a Schema record has the id 0, which means 'none'");
    }
  } else if constexpr (std::is_same_v<Record, Attachment>) {
    const Bytes covered = content.substr(0, content.size() - in.rest().size());
    const std::uint32_t crc = in.u32();
    if (in.ok() && crc != 0 && crc != crc32(covered)) {
      return problem(offset, "the attachment '" + record.name + "' is damaged: its CRC is wrong");
    }
  }
  if (!in.ok()) {
    return in.problem(opcode_name(static_cast<std::uint8_t>(Record::opcode)));
  }
  return record;
}

}  // namespace millrace::tools::mcap
