#include "cnc/simulator/objects/object.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>
#include <utility>

#include "cnc/variables/layout.hpp"

namespace millrace::cnc::simulator::objects {

Object object(std::string name, std::string type, std::string unit, Object::Read read,
              Object::Write write) {
  static const std::map<std::string_view, std::uint32_t> lengths{
      {"BOOL", 1},  {"SINT", 1},  {"WORD", 2},  {"UNS16", 2}, {"DINT", 4},  {"DWORD", 4},
      {"SGN32", 4}, {"UNS32", 4}, {"LREAL", 8}, {"SGN64", 8}, {"REAL64", 8}};
  const std::uint32_t length = lengths.at(type);
  return {.name = std::move(name),
          .type = std::move(type),
          .length = length,
          .unit = std::move(unit),
          .read = std::move(read),
          .write = std::move(write)};
}

void ObjectTable::add(std::uint32_t offset, Object object) {
  const bool is_new = objects_.emplace(offset, std::move(object)).second;
  assert(is_new);
  static_cast<void>(is_new);
}

void ObjectTable::add_rest(Object object) {
  rest_ = std::move(object);
}

const Object* ObjectTable::find(std::uint32_t offset) const {
  const auto found = objects_.find(offset);
  if (found != objects_.end()) {
    return &found->second;
  }
  return rest_ ? &*rest_ : nullptr;
}

using ads::ErrorCode;
using ads::Result;

ads::Bytes encode_s32(long value) {
  using Limits = std::numeric_limits<std::int32_t>;
  const long fitting = std::clamp<long>(value, Limits::min(), Limits::max());
  return encode_u32(fitting);
}

ads::Bytes encode_f64(double value) {
  return ads::ByteWriter().u64(std::bit_cast<std::uint64_t>(value)).take();
}

Result<ads::Bytes> encode_buffer(std::string_view text, std::size_t size) {
  if (text.size() >= size) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  return ads::ByteWriter().text(text).zeros(size - text.size()).take();
}

Result<std::uint16_t> decode_u16(ads::BytesView in) {
  ads::ByteReader reader(in);
  const std::uint16_t value = reader.u16();
  return reader.exact() ? Result<std::uint16_t>(value) : tl::unexpected(ErrorCode::invalid_size);
}

Result<std::uint32_t> decode_u32(ads::BytesView in) {
  ads::ByteReader reader(in);
  const std::uint32_t value = reader.u32();
  return reader.exact() ? Result<std::uint32_t>(value) : tl::unexpected(ErrorCode::invalid_size);
}

Result<std::string_view> decode_name(ads::BytesView in) {
  const auto stream = variables::decode_name(in);
  return stream ? Result<std::string_view>(stream->name) : tl::unexpected(ErrorCode::invalid_size);
}

Result<Selection> find_variable(const Context& at, std::string_view name) {
  const auto found = at.channel->store().find(name);
  return found ? Result<Selection>(*found)
               : tl::unexpected(at.machine.settings().answers.unknown_variable);
}

}  // namespace millrace::cnc::simulator::objects
