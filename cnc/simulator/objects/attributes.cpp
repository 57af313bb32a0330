#include "cnc/simulator/objects/attributes.hpp"

#include <cassert>

#include "cnc/ads/bytes.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

ads::Bytes text(std::string_view characters) {
  return ads::ByteWriter().text(characters).u8(0).take();
}

}  // namespace

ads::Bytes attribute_of(const Object& object, Attribute attribute) {
  switch (attribute) {
    case Attribute::name:
      return text(object.name);
    case Attribute::type:
      return text(object.type);
    case Attribute::length:
      return ads::ByteWriter().u32(object.length).take();
    case Attribute::unit:
      return text(object.unit);
    case Attribute::writable:
      return ads::ByteWriter().u8(object.write ? 1 : 0).take();
    case Attribute::value:
    case Attribute::address:
      break;
  }
  assert(false);
  return {};
}

}  // namespace millrace::cnc::simulator::objects
