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

}  // namespace millrace::cnc::simulator::objects
