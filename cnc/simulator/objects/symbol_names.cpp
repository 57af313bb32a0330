#include "cnc/simulator/objects/symbol_names.hpp"

#include <array>
#include <charconv>
#include <utility>

#include <fmt/format.h>

#include "cnc/nc/characters.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/type.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using nc::same_word;

/// A type's name here, and its number in TwinCAT (ADST_…).
constexpr std::array<std::pair<std::string_view, std::uint32_t>, 15> adst_types{{
    {"BOOL", 33},
    {"SINT", 16},
    {"SGN08", 16},
    {"UNS08", 17},
    {"SGN16", 2},
    {"UNS16", 18},
    {"WORD", 18},
    {"SGN32", 3},
    {"DINT", 3},
    {"UNS32", 19},
    {"DWORD", 19},
    {"SGN64", 20},
    {"REAL64", 5},
    {"LREAL", 5},
    {"STRING", 30},
}};

std::uint32_t adst_of(std::string_view type) {
  constexpr std::uint32_t big_type = 65;
  for (const auto& [name, number] : adst_types) {
    if (name == type) {
      return number;
    }
  }
  return big_type;
}

/// Takes "WORD[number]." off the front; 0 if something else is there.
std::uint32_t take_number(std::string_view word, std::string_view& name) {
  const std::size_t begin = word.size() + 1;
  if (name.size() <= begin || !same_word(name.substr(0, word.size()), word) ||
      name[word.size()] != '[') {
    return 0;
  }
  std::uint32_t number = 0;
  const char* const end = name.data() + name.size();
  const auto [at, error] = std::from_chars(name.data() + begin, end, number);
  if (error != std::errc() || end - at < 2 || at[0] != ']' || at[1] != '.') {
    return 0;
  }
  name = std::string_view(at + 2, static_cast<std::size_t>(end - at - 2));
  return number;
}

}  // namespace

/// As the controller numbers its groups.
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
  std::string type(variables::name_of(declaration.element.type));
  const std::uint32_t number = adst_of(type);
  return ads::Symbol{fmt::format("CH[{}].{}", channel.number(), name),
                     {number_of(group), *handle},
                     declaration.size(),
                     number,
                     0,
                     std::move(type),
                     ""};
}

std::optional<ads::Symbol> SymbolNames::find_system_data(std::string_view name) const {
  const auto place = machine_.system_data().find(name);
  if (!place || !machine_.settings().connections.variable_symbols) {
    return std::nullopt;
  }
  std::string type = place->element ? std::string(variables::name_of(place->element->type)) : "";
  const std::uint32_t number = adst_of(type);
  return ads::Symbol{std::string(name),
                     {system_data_group, place->offset},
                     place->size,
                     number,
                     0,
                     std::move(type),
                     ""};
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
  const Group group{place->kind, Attribute::value, channel};
  std::string written(place->object->name);
  if (axis != 0) {
    written = fmt::format("CH[{}].AX[{}].{}", channel, axis, written);
  } else if (channel != 0) {
    written = fmt::format("CH[{}].{}", channel, written);
  }
  return ads::Symbol{std::move(written),
                     {number_of(group), axis << axis_shift | place->offset},
                     place->object->length,
                     adst_of(place->object->type),
                     0,
                     place->object->type,
                     place->object->unit};
}

}  // namespace millrace::cnc::simulator::objects
