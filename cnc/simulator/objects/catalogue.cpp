#include "cnc/simulator/objects/catalogue.hpp"

#include <algorithm>
#include <utility>

#include "cnc/ads/bytes.hpp"
#include "cnc/nc/characters.hpp"
#include "cnc/simulator/objects/tables.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::ErrorCode;

constexpr std::uint32_t offset_mask = 0xFFFF;

/// Offset 0 of a group returns the number of its objects (IB/hmiviaads/15685565323, documented). We
/// return the highest offset, since the kernel's offsets have no gaps.
Object number_of_objects(const ObjectTable& table) {
  const std::uint32_t number = table.all().rbegin()->first;
  return object("number of objects", "UNS32", "",
                [number](const Context&) { return encode_u32(number); });
}

Object bytes_of_system_data() {
  return {
      .name = "system data",
      .type = "BYTES",
      .read = [](const Context& at) { return at.machine.system_data().read(at.offset, at.room); },
      .write =
          [](const Context& at, ads::BytesView bytes) {
            return at.machine.system_data().write(at.offset, bytes);
          }};
}

/// The scope and context that a group and the upper half of an offset address; an error if they do
/// not exist.
ads::Result<std::pair<Scope, Context>> resolve(Machine& machine, Group group, std::uint32_t axis) {
  Context at{machine, machine.channel(group.channel), axis};
  if (group.channel != 0 && at.channel == nullptr) {
    return tl::unexpected(ErrorCode::invalid_group);
  }
  if (group.channel == 0 && axis != 0) {
    const auto found = machine.axis(axis);
    return found ? ads::Result<std::pair<Scope, Context>>(
                       std::pair(Scope::cnc_axis, Context{machine, found->channel, found->number}))
                 : tl::unexpected(ErrorCode::invalid_offset);
  }
  if (axis == 0) {
    return std::pair(group.channel == 0 ? Scope::cnc : Scope::channel, at);
  }
  return axis <= at.channel->axes().size()
             ? ads::Result<std::pair<Scope, Context>>(std::pair(Scope::axis, at))
             : tl::unexpected(ErrorCode::invalid_offset);
}

}  // namespace

Catalogue::Catalogue() : variable_(variable_by_handle()), system_data_(bytes_of_system_data()) {
  constexpr std::uint16_t sda_port = variables::sda_port;
  ObjectTable& decoder = tables_[{sda_port, GroupKind::decoder, Scope::channel}];
  add_old_program_variables(decoder);
  add_old_external_variables(decoder);
  add_old_axis_variables(decoder);
  add_axis_names(decoder);
  add_old_global_variables(decoder);
  add_generic_variables(decoder);
  add_axis_functions(tables_[{sda_port, GroupKind::decoder, Scope::axis}]);
  add_interpolator_state(tables_[{geo_port, GroupKind::interpolator, Scope::channel}]);
  add_aep_parameters(tables_[{geo_port, GroupKind::interpolator, Scope::channel}]);
  add_channel_state(tables_[{geo_port, GroupKind::channel_state, Scope::channel}]);
  add_position_controller(tables_[{geo_port, GroupKind::position_controller, Scope::cnc_axis}]);
  for (auto& [key, table] : tables_) {
    table.add(0, number_of_objects(table));
    queries_.emplace(key.kind, address_query(key.kind));
  }
  // The COM task has a directory instead of counts and attributes.
  ObjectTable& commands = tables_[{com_port, GroupKind::com_channel, Scope::channel}];
  ObjectTable& platform = tables_[{com_port, GroupKind::com_channel, Scope::cnc}];
  add_commands(commands);
  add_platform(platform);
  add_channel_axes(tables_[{com_port, GroupKind::com_channel, Scope::axis}]);
  add_axes(tables_[{com_port, GroupKind::com_axis, Scope::cnc_axis}]);
  for (const Scope scope : {Scope::cnc, Scope::channel}) {
    add_directory(tables_[{com_port, GroupKind::com_directory, scope}], platform, commands);
  }
}

ads::Result<Target> Catalogue::find(Machine& machine, std::uint16_t port, ads::Index index,
                                    std::uint32_t room) const {
  if (index.group == system_data_group && port == variables::sda_port &&
      machine.settings().connections.variable_symbols) {
    Context at{machine};
    at.offset = index.offset;
    at.room = room;
    return Target{&system_data_, at, Attribute::value};
  }
  const auto group = Group::decode(index.group);
  const bool old = (index.group & variables::new_group_bit) == 0;
  const AnswerRules& rules = machine.settings().answers;
  if (!(old ? rules.old_groups : rules.current_groups)) {
    return tl::unexpected(ErrorCode::invalid_group);
  }
  if (!group || !has_kind(port, group->kind)) {
    return tl::unexpected(ErrorCode::invalid_group);
  }
  if (group->attribute == Attribute::address) {
    return find_query(machine, *group, index.offset);
  }
  if (const auto variable = find_variable(machine, *group, index.offset, room);
      variable && port == variables::sda_port) {
    return *variable;
  }
  auto resolved = resolve(machine, *group, index.offset >> axis_shift);
  if (!resolved) {
    return tl::unexpected(resolved.error());
  }
  auto& [scope, at] = *resolved;
  const auto table = tables_.find({port, group->kind, scope});
  if (table == tables_.end()) {
    return tl::unexpected(scope == Scope::axis || scope == Scope::cnc_axis
                              ? ErrorCode::invalid_offset
                              : ErrorCode::invalid_group);
  }
  at.offset = index.offset & offset_mask;
  at.room = room;
  const Object* const object = table->second.find(at.offset);
  return object != nullptr ? ads::Result<Target>(Target{object, at, group->attribute})
                           : tl::unexpected(ErrorCode::invalid_offset);
}

/// The address of a variable's symbol (our choice; no documented function reads or writes there):
/// the variable's handle as offset. The upper half of a handle is not the number of an axis.
std::optional<Target> Catalogue::find_variable(Machine& machine, Group group, std::uint32_t handle,
                                               std::uint32_t room) const {
  VirtualChannel* const channel = machine.channel(group.channel);
  const bool possible = group.kind == GroupKind::decoder && group.attribute == Attribute::value &&
                        machine.settings().connections.variable_symbols &&
                        handle >> axis_shift > max_axes && channel != nullptr;
  if (!possible || !channel->store().find(handle, {})) {
    return std::nullopt;
  }
  Context at{machine, channel};
  at.offset = handle;
  at.room = room;
  return Target{&variable_, at, Attribute::value};
}

ads::Result<Target> Catalogue::find_query(Machine& machine, Group group,
                                          std::uint32_t offset) const {
  const auto query = queries_.find(group.kind);
  const bool exists = group.channel == 0 || machine.channel(group.channel) != nullptr;
  if (query == queries_.end() || !exists) {
    return tl::unexpected(ErrorCode::invalid_group);
  }
  if (offset != 0) {
    return tl::unexpected(ErrorCode::invalid_offset);
  }
  return Target{&query->second, Context{machine}, Attribute::address};
}

std::optional<Catalogue::Place> Catalogue::find_by_name(std::uint16_t port, Scope scope,
                                                        std::string_view name) const {
  const std::vector<Place> places = named(port, scope);
  const auto found = std::ranges::find_if(
      places, [&](const Place& place) { return nc::same_word(place.object->name, name); });
  return found == places.end() ? std::nullopt : std::optional(*found);
}

std::vector<Catalogue::Place> Catalogue::named(std::uint16_t port, Scope scope) const {
  std::vector<Place> places;
  for (const auto& [key, table] : tables_) {
    if (key.port != port || key.scope != scope) {
      continue;
    }
    for (const auto& [offset, object] : table.all()) {
      if (object.read || object.write) {
        places.push_back({key.kind, offset, &object});
      }
    }
  }
  return places;
}

bool Catalogue::has_kind(std::uint16_t port, GroupKind kind) const {
  return std::any_of(tables_.begin(), tables_.end(), [&](const auto& entry) {
    return entry.first.port == port && entry.first.kind == kind;
  });
}

namespace {

bool exists(Machine& machine, GroupKind kind, std::uint32_t channel, std::uint32_t axis) {
  if (kind == GroupKind::position_controller) {
    return channel == 0 && machine.axis(axis).has_value();
  }
  const VirtualChannel* const found = machine.channel(channel);
  if (found == nullptr) {
    return false;
  }
  return axis == 0 || (kind == GroupKind::decoder && axis <= found->axes().size());
}

}  // namespace

Object address_query(GroupKind kind) {
  return {.name = "address query",
          .type = "UNS32",
          .length = 8,
          .exchange = [kind](const Context& at, ads::BytesView in) -> ads::Result<ads::Bytes> {
            ads::ByteReader reader(in);
            const std::uint32_t channel = reader.u32();
            const std::uint32_t axis = reader.u32();
            if (!reader.exact()) {
              return tl::unexpected(ads::ErrorCode::invalid_size);
            }
            if (!exists(at.machine, kind, channel, axis)) {
              return ads::ByteWriter().u32(0).u32(0).take();
            }
            const Group group{kind, Attribute::value, channel};
            return ads::ByteWriter().u32(group.number()).u32(axis << axis_shift).take();
          }};
}

}  // namespace millrace::cnc::simulator::objects
