// All objects of the virtual CNC, and the lookup of the object of a request.
//
//   const Catalogue catalogue;
//   auto target = catalogue.find(machine, 552, {0x122301, 0x48}, room);
//   target->object->exchange(target->at, name);
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "cnc/simulator/objects/group.hpp"
#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

// Tasks of the CNC (IB/tf527x_kernelv_api/402275851, documented); the third is variables::sda_port.
inline constexpr std::uint16_t geo_port = 551;
inline constexpr std::uint16_t com_port = 553;
/// The upper half of an index offset is the number of an axis (documented).
inline constexpr unsigned axis_shift = 16;

/// Index group of the symbols of system data (our choice: find them by name); the offset counts
/// bytes.
inline constexpr std::uint32_t system_data_group = 0x140000;

/// The objects of a group exist once per CNC, per channel, per axis of a channel, or per axis of
/// the CNC.
enum class Scope { cnc, channel, axis, cnc_axis };

/// An object, how it was addressed, and which attribute is read.
struct Target {
  const Object* object = nullptr;
  Context at;
  Attribute attribute = Attribute::value;
};

class Catalogue {
 public:
  Catalogue();

  /// Fails with invalid_group for an unknown group or channel, and with invalid_offset for an
  /// unknown axis or object.
  [[nodiscard]] ads::Result<Target> find(Machine& machine, std::uint16_t port, ads::Index index,
                                         std::uint32_t room) const;

  /// The address of an object without its channel and axis.
  struct Place {
    GroupKind kind = GroupKind::decoder;
    std::uint32_t offset = 0;
    const Object* object = nullptr;
  };
  /// A readable or writable object behind a port, by its name, case-insensitive.
  [[nodiscard]] std::optional<Place> find_by_name(std::uint16_t port, Scope scope,
                                                  std::string_view name) const;
  /// All objects that find_by_name() can find.
  [[nodiscard]] std::vector<Place> named(std::uint16_t port, Scope scope) const;

 private:
  [[nodiscard]] std::optional<Target> find_variable(Machine& machine, Group group,
                                                    std::uint32_t handle, std::uint32_t room) const;

  struct TableKey {
    std::uint16_t port = 0;
    GroupKind kind = GroupKind::decoder;
    Scope scope = Scope::channel;
    auto operator<=>(const TableKey&) const = default;
  };

  [[nodiscard]] ads::Result<Target> find_query(Machine& machine, Group group,
                                               std::uint32_t offset) const;
  [[nodiscard]] bool has_kind(std::uint16_t port, GroupKind kind) const;

  std::map<TableKey, ObjectTable> tables_;
  std::map<GroupKind, Object> queries_;
  /// The value of a variable; the offset is its handle.
  Object variable_;
  Object system_data_;
};

// The query for the address of a channel's or an axis's objects: attribute 0x600 of a group, offset
// 0 (IB/hmiviaads/15685565323, documented).

/// ReadWrite: UNS32 channel and UNS32 axis in; UNS32 group and UNS32 offset out, both 0 for an
/// unknown channel or axis.
Object address_query(GroupKind kind);

}  // namespace millrace::cnc::simulator::objects
