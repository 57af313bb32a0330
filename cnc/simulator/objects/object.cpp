#include "cnc/simulator/objects/object.hpp"

#include <cassert>
#include <utility>

namespace millrace::cnc::simulator::objects {

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

}  // namespace millrace::cnc::simulator::objects
