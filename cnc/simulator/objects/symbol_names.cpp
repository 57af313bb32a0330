#include "cnc/simulator/objects/symbol_names.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "base/text/ascii.hpp"
#include "cnc/nc/characters.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/names.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using nc::same_word;

/// The name of a type here, and in IEC 61131-3.
constexpr std::array<std::pair<std::string_view, std::string_view>, 9> iec_names{{
    {"BOOLEAN", "BOOL"},
    {"SGN08", "SINT"},
    {"UNS08", "USINT"},
    {"SGN16", "INT"},
    {"UNS16", "UINT"},
    {"SGN32", "DINT"},
    {"UNS32", "UDINT"},
    {"SGN64", "LINT"},
    {"REAL64", "LREAL"},
}};

std::optional<ads::DataType> no_structure(std::string_view /*name*/) {
  return std::nullopt;
}

/// The IEC name of a type with `size` bytes.
std::string iec_name(std::string_view type, std::uint32_t size) {
  const auto* const named =
      std::ranges::find(iec_names, type, [](const auto& name) { return name.first; });
  if (named != iec_names.end()) {
    return std::string(named->second);
  }
  if (type == "STRING") {
    return fmt::format("STRING({})", std::max(size, 1U) - 1);
  }
  if (ads::data_type(type, no_structure)) {
    return std::string(type);
  }
  return size == 0 ? "BYTE" : ads::array_name({{0, size}}, "BYTE");
}

std::string iec_name(ElementType element) {
  return iec_name(variables::name_of(element.type), element.size);
}

std::string structure_name(const DataDeclaration& data) {
  return "SD_" + data.name;
}

/// Removes "WORD[number]." from the front and returns the number; 0 for any other text.
std::uint32_t take_number(std::string_view word, std::string_view& name) {
  const std::size_t begin = word.size() + 1;
  if (name.size() <= begin || !same_word(name.substr(0, word.size()), word) ||
      name[word.size()] != '[') {
    return 0;
  }
  const std::size_t end = name.find("].");
  const auto number = base::text::parse_number<std::uint32_t>(name.substr(begin, end - begin));
  if (end == std::string_view::npos || !number) {
    return 0;
  }
  name.remove_prefix(end + 2);
  return *number;
}

}  // namespace

/// The number of a group on this controller, with or without 0x100000.
std::uint32_t SymbolNames::number_of(const Group& group) const {
  const bool current = machine_.settings().answers.current_groups;
  return current ? group.number() : group.number() & ~variables::new_group_bit;
}

std::optional<ads::Symbol> SymbolNames::find_variable(const VirtualChannel& channel,
                                                      std::string_view name) const {
  const auto handle = channel.store().handle(name);
  if (!handle || !machine_.settings().connections.variable_symbols) {
    return std::nullopt;
  }
  const Declaration& declaration = channel.store().find(*handle, {})->variable->declaration();
  const Group group{GroupKind::decoder, Attribute::value, channel.number()};
  std::string type = iec_name(declaration.element);
  if (!declaration.dimensions.empty()) {
    std::vector<ads::ArrayBounds> bounds;
    bounds.reserve(declaration.dimensions.size());
    for (const std::uint32_t elements : declaration.dimensions) {
      bounds.push_back({0, elements});
    }
    type = ads::array_name(bounds, type);
  }
  return symbol(fmt::format("CH[{}].{}", channel.number(), name), {number_of(group), *handle},
                declaration.size(), std::move(type));
}

std::optional<ads::Symbol> SymbolNames::find_system_data(std::string_view name) const {
  const auto place = machine_.system_data().find(name);
  if (!place || !machine_.settings().connections.variable_symbols) {
    return std::nullopt;
  }
  std::string type = place->element             ? iec_name(*place->element)
                     : place->data->structure() ? structure_name(*place->data)
                                                : iec_name(place->data->members.front().element);
  if (place->elements > 0) {
    type = ads::array_name({{1, place->elements}}, type);
  }
  return symbol(std::string(name), {system_data_group, place->offset}, place->size,
                std::move(type));
}

ads::Symbol SymbolNames::symbol(std::string name, ads::Index index, std::uint32_t size,
                                std::string type, std::string unit) const {
  const auto known = ads::data_type(type, [this](std::string_view structure_type) {
    return structure(variables::sda_port, structure_type);
  });
  return {std::move(name), index,          size, known ? known->number : ads::DataType{}.number, 0,
          std::move(type), std::move(unit)};
}

std::optional<ads::Symbol> SymbolNames::find(std::uint16_t port, std::string_view name) const {
  if (port == variables::sda_port && is_system_data(name)) {
    return find_system_data(name);
  }
  std::string_view rest = name;
  const std::uint32_t channel = take_number("CH", rest);
  const std::uint32_t axis = channel == 0 ? 0 : take_number("AX", rest);
  const VirtualChannel* const found = machine_.channel(channel);
  if ((channel != 0 && found == nullptr) || (axis != 0 && axis > found->axes().size())) {
    return std::nullopt;
  }
  if (port == variables::sda_port && found != nullptr && axis == 0) {
    if (auto variable = find_variable(*found, rest)) {
      return variable;
    }
  }
  const Scope scope = channel == 0 ? Scope::cnc : (axis == 0 ? Scope::channel : Scope::axis);
  const auto place = catalogue_.find_by_name(port, scope, rest);
  if (!place) {
    return std::nullopt;
  }
  return symbol_of(*place, channel, axis);
}

ads::Symbol SymbolNames::symbol_of(const Catalogue::Place& place, std::uint32_t channel,
                                   std::uint32_t axis) const {
  const Group group{place.kind, Attribute::value, channel};
  std::string written(place.object->name);
  if (axis != 0) {
    written = fmt::format("CH[{}].AX[{}].{}", channel, axis, written);
  } else if (channel != 0) {
    written = fmt::format("CH[{}].{}", channel, written);
  }
  return symbol(std::move(written), {number_of(group), axis << axis_shift | place.offset},
                place.object->length, iec_name(place.object->type, place.object->length),
                place.object->unit);
}

void SymbolNames::add_objects(std::vector<ads::Symbol>& symbols, std::uint16_t port,
                              std::uint32_t channel, std::uint32_t axis) const {
  const Scope scope = channel == 0 ? Scope::cnc : (axis == 0 ? Scope::channel : Scope::axis);
  const std::size_t first = symbols.size();
  for (const Catalogue::Place& place : catalogue_.named(port, scope)) {
    ads::Symbol symbol = symbol_of(place, channel, axis);
    // Groups of one scope may use a name twice; the first of them counts.
    const bool known =
        std::any_of(symbols.begin() + static_cast<std::ptrdiff_t>(first), symbols.end(),
                    [&](const ads::Symbol& other) { return same_word(other.name, symbol.name); });
    if (!known) {
      symbols.push_back(std::move(symbol));
    }
  }
}

std::vector<ads::Symbol> SymbolNames::all(std::uint16_t port) const {
  std::vector<ads::Symbol> symbols;
  add_objects(symbols, port, 0, 0);
  for (std::uint32_t number = 1; number <= machine_.settings().channels; ++number) {
    add_objects(symbols, port, number, 0);
    const VirtualChannel& channel = *machine_.channel(number);
    for (std::uint32_t axis = 1; axis <= channel.axes().size(); ++axis) {
      add_objects(symbols, port, number, axis);
    }
    for (const Kind kind : all_kinds) {
      const Family& family = channel.store().family(kind);
      for (std::size_t i = 0; port == variables::sda_port && i < family.size(); ++i) {
        if (auto variable = find_variable(channel, family.at(i).declaration().name)) {
          symbols.push_back(*std::move(variable));
        }
      }
    }
  }
  for (const DataDeclaration* const data : machine_.system_data().all()) {
    if (port == variables::sda_port) {
      if (auto found = find_system_data("SD." + data->name)) {
        symbols.push_back(*std::move(found));
      }
    }
  }
  return symbols;
}

std::optional<ads::DataType> SymbolNames::structure(std::uint16_t port,
                                                    std::string_view name) const {
  for (const DataDeclaration* const data : machine_.system_data().all()) {
    if (port == variables::sda_port && data->structure() &&
        same_word(structure_name(*data), name)) {
      ads::DataType type{.name = structure_name(*data), .size = data->element_size()};
      std::uint32_t offset = 0;
      for (const DataMember& member : data->members) {
        type.items.push_back({member.name, iec_name(member.element), member.element.size, offset});
        offset += member.element.size;
      }
      return type;
    }
  }
  return std::nullopt;
}

}  // namespace millrace::cnc::simulator::objects
