#include "fabric/encoding/plan.hpp"

#include <algorithm>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include "base/text/cp1252.hpp"
#include "fabric/channel_scope.hpp"

namespace millrace::fabric::encoding {

namespace {

using Type = google::protobuf::FieldDescriptor;
using In = google::protobuf::io::CodedInputStream;
using Lite = google::protobuf::internal::WireFormatLite;

constexpr std::uint32_t bytes_follow = Lite::WIRETYPE_LENGTH_DELIMITED;

bool is_number(Kind kind) {
  return kind <= Kind::milliseconds;
}

void put_varint(std::string& out, std::uint64_t number) {
  std::array<char, 10> bytes{};
  std::size_t size = 0;
  for (; number >= 0x80; number >>= 7U) {
    bytes[size++] = static_cast<char>(number | 0x80U);
  }
  bytes[size++] = static_cast<char>(number);
  out.append(bytes.data(), size);
}

bool is_fixed(Type::Type type) {
  return type == Type::TYPE_FIXED64 || type == Type::TYPE_SFIXED64 || type == Type::TYPE_DOUBLE;
}

void put_number(std::string& out, Type::Type type, std::uint64_t number) {
  if (is_fixed(type)) {
    out.append(reinterpret_cast<const char*>(&number), sizeof number);
  } else if (type == Type::TYPE_SINT64) {
    put_varint(out, Lite::ZigZagEncode64(static_cast<std::int64_t>(number)));
  } else {
    put_varint(out, number);
  }
}

bool take_number(In& in, Type::Type type, std::uint64_t& number) {
  if (is_fixed(type)) {
    return in.ReadLittleEndian64(&number);
  }
  if (!in.ReadVarint64(&number)) {
    return false;
  }
  if (type == Type::TYPE_SINT64) {
    number = static_cast<std::uint64_t>(Lite::ZigZagDecode64(number));
  } else if (type == Type::TYPE_BOOL) {
    number = number != 0 ? 1 : 0;
  }
  return true;
}

void put_bytes(std::string& out, std::uint32_t tag, std::string_view bytes) {
  put_varint(out, tag);
  put_varint(out, bytes.size());
  out.append(bytes);
}

/// Writes what `put` adds, and its size before it.
template <typename Put>
void put_sized(std::string& out, std::uint32_t tag, const Put& put) {
  put_varint(out, tag);
  const std::size_t begin = out.size();
  out.push_back('\0');
  put();
  const std::size_t size = out.size() - begin - 1;
  if (size < 0x80) {
    out[begin] = static_cast<char>(size);
    return;
  }
  std::string varint;
  put_varint(varint, size);
  out.replace(begin, 1, varint);
}

bool take_bytes(In& in, std::string_view& bytes) {
  std::uint32_t size = 0;
  if (!in.ReadVarint32(&size)) {
    return false;
  }
  const void* data = nullptr;
  int left = 0;
  if (size > 0 &&
      (!in.GetDirectBufferPointer(&data, &left) || static_cast<std::uint32_t>(left) < size)) {
    return false;
  }
  bytes = {static_cast<const char*>(data), size};
  return in.Skip(static_cast<int>(size));
}

/// A code that only a later version knows keeps its number; none has more than an octet.
void set(Kind kind, void* member, std::uint64_t number) {
  constexpr std::uint64_t most = 0xff;
  set_number(kind, member, kind == Kind::word ? std::min(number, most) : number);
}

/// Fields of type string hold UTF-8. Texts of the fabric are, by convention; where one is not, its
/// bytes are the controller's.
void put_text(std::string& out, std::uint32_t tag, std::uint32_t raw_tag, Type::Type type,
              const std::string& text) {
  if (type == Type::TYPE_BYTES || base::text::is_utf8(text)) {
    put_bytes(out, tag, text);
    return;
  }
  put_bytes(out, tag, base::text::to_utf8(text));
  if (raw_tag != 0) {
    put_bytes(out, raw_tag, text);
  }
}

// The fields of a sentence in recording.Message.
constexpr std::uint32_t code_tag = 1U << 3U | bytes_follow;
constexpr std::uint32_t argument_tag = 2U << 3U | bytes_follow;
constexpr std::uint32_t text_tag = 3U << 3U | bytes_follow;
/// Of sentences in one another, and of arguments; in a foreign file more are left out, since each
/// costs more memory than bytes of the file.
constexpr int most_depth = 4;
constexpr std::size_t most_arguments = 8;

void put_message(std::string& out, const Message& message, bool with_text) {
  if (!message.code.empty()) {
    put_bytes(out, code_tag, message.code);
  }
  for (const Message& argument : message.arguments) {
    put_sized(out, argument_tag, [&] { put_message(out, argument, true); });
  }
  if (with_text && !message.text.empty()) {
    put_text(out, text_tag, 0, Type::TYPE_STRING, message.text);
  }
}

/// Adds to `message` what the bytes have.
bool take_message(std::string_view bytes, Message& message, int depth = 0) {
  In in(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
  while (const std::uint32_t tag = in.ReadTag()) {
    std::string_view inner;
    if (tag != code_tag && tag != argument_tag && tag != text_tag) {
      if (!Lite::SkipField(&in, tag)) {
        return false;
      }
      continue;
    }
    if (!take_bytes(in, inner)) {
      return false;
    }
    if (tag == code_tag) {
      message.code = inner;
    } else if (tag == text_tag) {
      message.text = inner;
    } else if (depth < most_depth && message.arguments.size() < most_arguments &&
               !take_message(inner, message.arguments.emplace_back(), depth + 1)) {
      return false;
    }
  }
  return in.ConsumedEntireMessage();
}

/// An invalid scope matches no channel: if it were dropped, the instance would seem to serve every
/// channel.
ChannelScope scope_of(std::string_view text) {
  constexpr std::string_view mark = "?";
  constexpr std::string_view any = "/*";
  if (auto scope = parse_channel_scope(text)) {
    return *std::move(scope);
  }
  if (text.starts_with(mark) && text.ends_with(any)) {
    // As it was written again.
    return {.machine = std::string(text.substr(0, text.size() - any.size()))};
  }
  return {.machine = std::string(mark) + std::string(text)};
}

}  // namespace

Plan::Plan(Shape shape, const google::protobuf::Descriptor& message, const Plan* other)
    : message_(message) {
  add(shape, {}, other);
}

void* Plan::Place::member(void* value) const {
  for (const Leaf* leaf : path) {
    value = leaf->member(value);
  }
  return value;
}

void Plan::add(Shape shape, const std::vector<const Leaf*>& path, const Plan* other) {
  for (const Leaf& leaf : shape) {
    std::vector<const Leaf*> here = path;
    here.push_back(&leaf);
    std::string name(leaf.options.proto.empty() ? leaf.name : leaf.options.proto);
    name += leaf.kind == Kind::nanoseconds ? "_ns" : leaf.kind == Kind::milliseconds ? "_ms" : "";
    const Type* const field = message_.FindFieldByName(name);
    if (field == nullptr) {
      if (leaf.kind == Kind::shape) {
        add(leaf.shape(), here, other);
      }
    } else if (other == nullptr ||
               other->by_number_.at(static_cast<std::size_t>(field->number())) == 0) {
      add(here, *field);
      const Type* const raw = message_.FindFieldByName(name + "_bytes");
      if (raw != nullptr && leaf.kind == Kind::text) {
        add(here, *raw);
        places_[places_.size() - 2].raw_tag = places_.back().tag;
        places_.back().is_read_only = true;
      }
      const Type* const message = message_.FindFieldByName(name + "_message");
      if (message != nullptr && leaf.kind == Kind::message) {
        add(here, *message);
      }
    }
  }
}

void Plan::add(const std::vector<const Leaf*>& path, const Type& field) {
  const auto number = static_cast<std::uint32_t>(field.number());
  const auto wire = Lite::WireTypeForFieldType(static_cast<Lite::FieldType>(field.type()));
  Place& place = places_.emplace_back(
      Place{.path = path,
            .type = field.type(),
            .tag = number << 3U | (field.is_packed() ? bytes_follow : std::uint32_t{wire}),
            .is_packed = field.is_packed()});
  if (const Leaf& leaf = place.leaf(); leaf.shape != nullptr) {
    place.inner = std::make_unique<const Plan>(leaf.shape(), *field.message_type());
  }
  by_number_.at(number) = static_cast<std::uint8_t>(places_.size());
}

void Plan::write(const void* value, std::string& out) const {
  for (const Place& place : places_) {
    const void* const member = place.member(const_cast<void*>(value));
    const Leaf& leaf = place.leaf();
    if (place.is_read_only) {
      continue;
    }
    switch (leaf.kind) {
      case Kind::text:
        if (const auto& text = as<std::string>(member); !text.empty()) {
          put_text(out, place.tag, place.raw_tag, place.type, text);
        }
        break;
      case Kind::message:
        if (const auto& message = as<Message>(member); place.type == Type::TYPE_STRING) {
          if (!message.text.empty()) {
            put_text(out, place.tag, 0, place.type, message.text);
          }
        } else if (!message.code.empty()) {
          put_sized(out, place.tag, [&] { put_message(out, message, false); });
        }
        break;
      case Kind::id:
        if (const auto& id = as<InstanceId>(member); id != InstanceId{}) {
          put_bytes(out, place.tag,
                    {reinterpret_cast<const char*>(id.bytes.data()), id.bytes.size()});
        }
        break;
      case Kind::scope:
        put_bytes(out, place.tag, format_channel_scope(as<ChannelScope>(member)));
        break;
      case Kind::maybe_u32:
        if (const auto& number = as<std::optional<std::uint32_t>>(member)) {
          put_varint(out, place.tag);
          put_number(out, place.type, *number);
        }
        break;
      case Kind::maybe_i64:
        if (const auto& number = as<std::optional<std::int64_t>>(member)) {
          put_varint(out, place.tag);
          put_number(out, place.type, static_cast<std::uint64_t>(*number));
        }
        break;
      case Kind::shape:
        put_sized(out, place.tag, [&] { place.inner->write(member, out); });
        break;
      case Kind::list:
        write_list(place, member, out);
        break;
      default:
        if (const std::uint64_t number = number_of(leaf.kind, member); number != 0) {
          put_varint(out, place.tag);
          put_number(out, place.type, number);
        }
    }
  }
}

void Plan::write_list(const Place& place, const void* list, std::string& out) const {
  const Leaf& leaf = place.leaf();
  const std::size_t size = leaf.size(list);
  if (place.is_packed && size > 0) {
    put_sized(out, place.tag, [&] {
      for (std::size_t i = 0; i < size; ++i) {
        put_number(out, place.type, number_of(leaf.element, leaf.get(list, i)));
      }
    });
    return;
  }
  for (std::size_t i = 0; i < size; ++i) {
    const void* const element = leaf.get(list, i);
    if (place.inner) {
      put_sized(out, place.tag, [&] { place.inner->write(element, out); });
    } else if (leaf.element == Kind::scope) {
      put_bytes(out, place.tag, format_channel_scope(as<ChannelScope>(element)));
    } else if (leaf.element == Kind::text) {
      put_text(out, place.tag, 0, place.type, as<std::string>(element));
    } else {
      put_varint(out, place.tag);
      put_number(out, place.type, number_of(leaf.element, element));
    }
  }
}

bool Plan::read_number(const Place& place, void* member, In& in) {
  std::uint64_t number = 0;
  if (!take_number(in, place.type, number)) {
    return false;
  }
  const Leaf& leaf = place.leaf();
  if (leaf.kind == Kind::list) {
    set(leaf.element, leaf.add(member), number);
  } else {
    set(leaf.kind, member, number);
  }
  return true;
}

bool Plan::read_bytes(const Place& place, void* member, std::string_view bytes) {
  const Leaf& leaf = place.leaf();
  const bool is_list = leaf.kind == Kind::list;
  const Kind kind = is_list ? leaf.element : leaf.kind;
  if (is_number(kind)) {
    In packed(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
    while (packed.CurrentPosition() < static_cast<int>(bytes.size())) {
      if (!read_number(place, member, packed)) {
        return false;
      }
    }
    return true;
  }
  void* const to = is_list ? leaf.add(member) : member;
  if (place.inner) {
    return place.inner->read(to, bytes);
  }
  if (kind == Kind::message) {
    auto& message = as<Message>(to);
    if (place.type != Type::TYPE_STRING) {
      return take_message(bytes, message);
    }
    message.text = bytes;
  } else if (kind == Kind::text) {
    as<std::string>(to) = bytes;
  } else if (kind == Kind::scope) {
    as<ChannelScope>(to) = scope_of(bytes);
  } else if (kind == Kind::id) {
    // A foreign or damaged file may hold fewer bytes, or more.
    InstanceId id;
    std::copy_n(bytes.begin(), std::min(bytes.size(), id.bytes.size()), id.bytes.begin());
    as<InstanceId>(to) = id;
  }
  return true;
}

bool Plan::read(void* value, std::string_view bytes) const {
  for (const Place& place : places_) {
    if (is_number(place.leaf().kind)) {
      set_number(place.leaf().kind, place.member(value), 0);
    }
  }
  In in(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
  while (const std::uint32_t tag = in.ReadTag()) {
    const std::uint32_t number = tag >> 3U;
    const std::uint32_t wire = tag & 7U;
    const std::uint8_t known = number < by_number_.size() ? by_number_[number] : 0;
    const Place* const place = known == 0 ? nullptr : &places_[known - 1];
    // A list of numbers comes packed or not, whatever the message says.
    const bool is_list = place != nullptr && place->leaf().kind == Kind::list;
    bool is_whole = false;
    if (place != nullptr && wire == bytes_follow &&
        (tag == place->tag || (is_list && is_number(place->leaf().element)))) {
      std::string_view inner;
      is_whole = take_bytes(in, inner) && read_bytes(*place, place->member(value), inner);
    } else if (place != nullptr && wire == static_cast<std::uint32_t>(Lite::WireTypeForFieldType(
                                               static_cast<Lite::FieldType>(place->type)))) {
      is_whole = read_number(*place, place->member(value), in);
    } else {
      is_whole = Lite::SkipField(&in, tag);
    }
    if (!is_whole) {
      return false;
    }
  }
  return in.ConsumedEntireMessage();
}

}  // namespace millrace::fabric::encoding
