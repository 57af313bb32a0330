#include "cnc/variables/layout.hpp"

#include <algorithm>

#include "cnc/variables/addresses.hpp"

namespace millrace::cnc::variables {
namespace {

using ads::ByteReader;
using ads::ByteWriter;

void write_list(ByteWriter& out, const std::vector<std::uint32_t>& values) {
  out.u32(static_cast<std::uint32_t>(values.size()));
  for (const auto value : values) {
    out.u32(value);
  }
}

std::vector<std::uint32_t> read_list(ByteReader& in) {
  std::vector<std::uint32_t> values;
  const auto count = in.u32();
  for (std::uint32_t i = 0; i < count && in.ok(); ++i) {
    values.push_back(in.u32());
  }
  return values;
}

}  // namespace

Bytes encode(const Description& description, NameInDescription with_name) {
  ByteWriter out;
  out.u32(description.handle).u32(static_cast<std::uint32_t>(description.type));
  out.u32(static_cast<std::uint32_t>(description.access)).u32(description.size);
  write_list(out, description.dimensions);
  if (with_name == NameInDescription::yes) {
    out.text(description.name).u8(0);
  }
  return out.take();
}

std::optional<Description> decode_description(BytesView stream) {
  ByteReader in(stream);
  Description description;
  description.handle = in.u32();
  description.type = Type{in.u32()};
  description.access = Access{in.u32()};
  description.size = in.u32();
  description.dimensions = read_list(in);
  if (!in.ok()) {
    return std::nullopt;
  }
  description.name = ads::text_in(in.rest());
  return description;
}

Bytes encode(const ElementOf& element, BytesView value) {
  ByteWriter out;
  out.u32(element.handle);
  write_list(out, element.indices);
  return out.bytes(value).take();
}

std::optional<HandleStream> decode_handle_stream(BytesView stream) {
  ByteReader in(stream);
  HandleStream decoded;
  decoded.element.handle = in.u32();
  decoded.element.indices = read_list(in);
  decoded.value = in.rest();
  return in.ok() ? std::optional(decoded) : std::nullopt;
}

Bytes encode_name(std::string_view name, BytesView value) {
  ByteWriter out;
  return out.text(name).u8(0).bytes(value).take();
}

std::optional<NameStream> decode_name(BytesView stream) {
  const auto name = ads::text_in(stream);
  if (name.empty() || name.size() >= max_name) {
    return std::nullopt;
  }
  const auto behind_nul = std::min(name.size() + 1, stream.size());
  return NameStream{name, stream.subspan(behind_nul)};
}

Bytes encode(const IndexStream& stream) {
  ByteWriter out;
  return out.u32(stream.index).text(stream.kind).u8(0).take();
}

std::optional<IndexStream> decode_index_stream(BytesView stream) {
  ByteReader in(stream);
  const auto index = in.u32();
  if (!in.ok()) {
    return std::nullopt;
  }
  return IndexStream{index, ads::text_in(in.rest())};
}

}  // namespace millrace::cnc::variables
