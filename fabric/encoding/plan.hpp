// A value as the bytes of a protobuf message, and back, by the list of its fields and the message's
// descriptor.
//
//   static const Plan plan(shape_of<Request>(), *recording::Request::descriptor());
//   plan.write(&request, bytes);
//   plan.read(&request, bytes)      // false if the bytes are damaged
//
// A field stands in the message under its own name, a duration with _ns or _ms behind it. What
// cannot be UTF-8 stands as it is in a second field NAME_bytes, if the message has one; code and
// arguments of a sentence stand in NAME_message. A number
// that is 0, an empty text and an id of zeros are left out.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <google/protobuf/descriptor.h>

#include "fabric/shape.hpp"

namespace google::protobuf::io {
class CodedInputStream;
}

namespace millrace::fabric::encoding {

/// Which leaf stands in which field; made once for each pair. A leaf without a field is left out.
class Plan {
 public:
  /// Leaves the fields alone that stand in `other` already.
  Plan(Shape shape, const google::protobuf::Descriptor& message, const Plan* other = nullptr);

  [[nodiscard]] bool is_empty() const { return places_.empty(); }
  void write(const void* value, std::string& out) const;
  /// A missing number becomes 0, whatever the value begins with; a code that this version does not
  /// know keeps its number.
  [[nodiscard]] bool read(void* value, std::string_view bytes) const;

 private:
  struct Place {
    /// From the value to the member, through those that have no field of their own.
    std::vector<const Leaf*> path;
    google::protobuf::FieldDescriptor::Type type{};
    std::uint32_t tag = 0;
    /// Of the second field of a text, for bytes that are not UTF-8, which has a place of its own.
    std::uint32_t raw_tag = 0;
    bool is_packed = false;
    bool is_read_only = false;
    std::unique_ptr<const Plan> inner{};

    [[nodiscard]] const Leaf& leaf() const { return *path.back(); }
    [[nodiscard]] void* member(void* value) const;
  };

  void add(Shape shape, const std::vector<const Leaf*>& path, const Plan* other);
  void add(const std::vector<const Leaf*>& path, const google::protobuf::FieldDescriptor& field);
  void write_list(const Place& place, const void* list, std::string& out) const;
  static bool read_number(const Place& place, void* member,
                          google::protobuf::io::CodedInputStream& in);
  static bool read_bytes(const Place& place, void* member, std::string_view bytes);

  const google::protobuf::Descriptor& message_;
  std::vector<Place> places_;
  /// By the number of a field: 1 + the index of its place.
  std::array<std::uint8_t, 64> by_number_{};
};

}  // namespace millrace::fabric::encoding
