#include <algorithm>
#include <cassert>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "cnc/simulator/objects/tables.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::BytesView;
using ads::ErrorCode;
using ads::Result;

/// Bytes of the buffers of names and descriptions (documented).
constexpr std::uint32_t long_text = 96;
constexpr std::uint32_t short_text = 20;
/// S_WRITE_VAR_DATA: the name, then the value. That the value is at 96 and not at 92 is inferred
/// from the documented size and the alignment of a REAL64.
constexpr std::size_t listed_name_size = 92;
constexpr std::size_t write_size = 120;

/// Values of the old functions: EXT_VAR_WERT, a union of 24 bytes (IB/hmiviaads/15685580171,
/// documented), and the longest text in it, without the NUL.
constexpr std::size_t old_value_size = 24;
constexpr std::size_t old_text_characters = 20;
/// Bytes of VAR_STRING in the union.
constexpr std::size_t text_size = old_text_characters + 1;

/// The characters and their NUL, or all bytes if there is no NUL.
BytesView text_in(BytesView bytes) {
  const auto nul = std::find(bytes.begin(), bytes.end(), std::uint8_t{0});
  const auto end = nul == bytes.end() ? nul : nul + 1;
  return bytes.first(static_cast<std::size_t>(end - bytes.begin()));
}

bool is_text(const Variable& variable) {
  return variable.declaration().element.type == Type::string;
}

/// A number is at the front, and so is a string of at most 20 characters with its NUL. A longer
/// string fails with invalid_size (our choice).
Result<Bytes> read_old_value(const Variable& variable, std::uint32_t element) {
  Bytes bytes = variable.bytes(element);
  if (is_text(variable)) {
    bytes.resize(text_in(bytes).size());
    if (bytes.size() > text_size) {
      return tl::unexpected(ErrorCode::invalid_size);
    }
  }
  bytes.resize(old_value_size, 0);
  return bytes;
}

/// `value` has old_value_size bytes.
Result<void> write_old_value(Variable& variable, std::uint32_t element, BytesView value) {
  assert(value.size() == old_value_size);
  if (is_text(variable)) {
    return variable.write(element, text_in(value.first(text_size)));
  }
  return variable.write(element, value.first(variable.declaration().element.size));
}

/// The variables of one kind in a row.
struct Listing {
  std::size_t (*size)(const VirtualChannel&);
  /// `index` is smaller than size.
  const Variable& (*at)(const VirtualChannel&, std::size_t index);
  std::string (*name)(const VirtualChannel&, std::size_t index);
};

template <Kind kind>
const Variable& variable_at(const VirtualChannel& channel, std::size_t index) {
  return channel.store().family(kind).listed_at(index);
}

/// All variables of a family; of the axes, one entry for each quantity, without the axis.
template <Kind kind>
Listing list_family() {
  return {[](const VirtualChannel& channel) { return channel.store().family(kind).listed(); },
          variable_at<kind>,
          [](const VirtualChannel& channel, std::size_t index) {
            return variable_at<kind>(channel, index).declaration().listed();
          }};
}

/// An attribute of the variable whose index, an UNS32, is the input; invalid_data beyond the last
/// variable. Texts are returned in a buffer of `length` bytes.
template <typename Fact>
Object by_index(std::string_view name, std::string_view type, std::uint32_t length, Listing listing,
                Fact fact) {
  return {.name = std::string(name),
          .type = std::string(type),
          .length = length,
          .exchange = [listing, fact](const Context& at, BytesView in) {
            return decode_u32(in).and_then([&](std::uint32_t index) -> Result<Bytes> {
              if (index >= listing.size(*at.channel)) {
                return tl::unexpected(ErrorCode::invalid_data);
              }
              return fact(*at.channel, index);
            });
          }};
}

/// The axes themselves.
Listing list_axes() {
  return {[](const VirtualChannel& channel) { return channel.axes().size(); },
          [](const VirtualChannel& channel, std::size_t index) -> const Variable& {
            return channel.store().family(Kind::axis).at(index);
          },
          [](const VirtualChannel& channel, std::size_t index) {
            return channel.axes().at(index).name;
          }};
}

/// The number of variables; a Read without input.
Object count(std::string name, Listing listing) {
  return object(std::move(name), "UNS32", "",
                [listing](const Context& at) { return encode_u32(listing.size(*at.channel)); });
}

Object name_by_index(std::string_view name, std::uint32_t length, Listing listing) {
  return by_index(name, "STRING", length, listing,
                  [listing, length](const VirtualChannel& channel, std::size_t index) {
                    return encode_buffer(listing.name(channel, index), length);
                  });
}

Object text_by_index(std::string_view name, std::uint32_t length, Listing listing,
                     std::string (*text)(const Declaration&)) {
  return by_index(name, "STRING", length, listing,
                  [listing, length, text](const VirtualChannel& channel, std::size_t index) {
                    return encode_buffer(text(listing.at(channel, index).declaration()), length);
                  });
}

Object number_by_index(std::string_view name, Listing listing,
                       std::uint32_t (*number)(const Declaration&)) {
  return by_index(
      name, "UNS32", 4, listing,
      [listing, number](const VirtualChannel& channel, std::size_t index) -> Result<Bytes> {
        return encode_u32(number(listing.at(channel, index).declaration()));
      });
}

/// EXT_VAR_WERT of a scalar or of the first element of an array.
Object value_by_index(std::string_view name, Listing listing) {
  return by_index(name, "EXT_VAR_WERT", old_value_size, listing,
                  [listing](const VirtualChannel& channel, std::size_t index) {
                    return read_old_value(listing.at(channel, index), Variable::scalar);
                  });
}

/// ReadWrite with a name in, EXT_VAR_WERT out.
Object value_by_name(std::string name) {
  return {.name = std::move(name),
          .type = "EXT_VAR_WERT",
          .length = old_value_size,
          .exchange = [](const Context& at, BytesView in) {
            return decode_name(in)
                .and_then([&](std::string_view variable) { return find_variable(at, variable); })
                .and_then([](const Selection& found) -> Result<Bytes> {
                  return found.element ? read_old_value(*found.variable, *found.element)
                                       : tl::unexpected(ErrorCode::invalid_data);
                });
          }};
}

/// For example "V_UNS32".
std::string type_text(const Declaration& declaration) {
  return fmt::format("V_{}", name_of(declaration.element.type));
}

Object write_by_name(std::string name) {
  return {.name = std::move(name),
          .type = "S_WRITE_VAR_DATA",
          .length = write_size,
          .write = [](const Context& at, ads::BytesView in) -> Result<void> {
            if (in.size() != write_size) {
              return tl::unexpected(ErrorCode::invalid_size);
            }
            const std::size_t value_at = at.machine.settings().answers.old_value_offset;
            return find_variable(at, variables::decode_text(in.first(listed_name_size)))
                .and_then([&](const Selection& found) -> Result<void> {
                  return found.element ? write_old_value(*found.variable, *found.element,
                                                         in.subspan(value_at, old_value_size))
                                       : tl::unexpected(ErrorCode::invalid_data);
                });
          }};
}

std::string mode_text(const Declaration& declaration) {
  return declaration.access == Access::read_only ? "READ_ONLY" : "READ_WRITE";
}

/// The part that a client appends to the listed name, or replaces in it (IB/hmiviaads/15685595531,
/// documented).
std::string node_text(const Declaration& declaration) {
  if (declaration.axis > 0) {
    return "V_AXIS_NAME";
  }
  return declaration.dimensions.empty() ? "V_VALUE" : "V_ARRAY_INDEX";
}

std::string place_text(const Declaration& declaration) {
  return declaration.external->global ? "GLOBAL" : "CHANNEL";
}

std::uint32_t dimension(const Declaration& declaration) {
  return declaration.dimensions.empty() ? 0 : declaration.dimensions.front();
}

std::uint32_t address(const Declaration& declaration) {
  return declaration.external->address;
}

std::uint32_t synchronisation(const Declaration& declaration) {
  return declaration.external->synchronisation();
}

std::uint32_t size(const Declaration& declaration) {
  return declaration.size();
}

}  // namespace

void add_old_external_variables(ObjectTable& table) {
  const Listing all = list_family<Kind::external>();
  table.add(0x27, count("Number V.E parameters", all));
  table.add(0x28, number_by_index("V.E-dim by index", all, dimension));
  table.add(0x29, name_by_index("V.E-name by index", short_text, all));
  table.add(0x2A, text_by_index("V.E-type by index", short_text, all, type_text));
  table.add(0x2B, number_by_index("V.E-address by index", all, address));
  table.add(0x2C, text_by_index("V.E-mem-place by index", short_text, all, place_text));
  table.add(0x2D, number_by_index("V.E-Synchron mode", all, synchronisation));
  table.add(0x2E, value_by_index("V.E-value by index", all));
  table.add(0x2F, value_by_name("V.E-array-value by index"));
  table.add(0x30, number_by_index("V.E-Size by index", all, size));
}

void add_old_axis_variables(ObjectTable& table) {
  const Listing all = list_family<Kind::axis>();
  table.add(0x31, count("V.A-max. number", all));
  table.add(0x32, name_by_index("V.A-name by index", long_text, all));
  table.add(0x33, text_by_index("V.A-type by index", long_text, all, type_text));
  table.add(0x34, text_by_index("V.A-mode by index", long_text, all, mode_text));
  table.add(0x37, value_by_name("V.A-read value by name"));
  table.add(0x38, write_by_name("V.A-write value by name"));
}

void add_axis_names(ObjectTable& table) {
  const Listing axes = list_axes();
  table.add(0x35, count("Number of axis in channel", axes));
  table.add(0x36, name_by_index("Name of axis by index", long_text, axes));
}

void add_old_global_variables(ObjectTable& table) {
  const Listing all = list_family<Kind::global>();
  table.add(0x39, count("V.G-max. number", all));
  table.add(0x3A, name_by_index("V.G-name by index", long_text, all));
  table.add(0x3B, text_by_index("V.G-type by index", long_text, all, type_text));
  table.add(0x3C, text_by_index("V.G-mode by index", long_text, all, mode_text));
  table.add(0x3D, text_by_index("V.G-node by index", long_text, all, node_text));
  table.add(0x3E, value_by_name("V.G-read value by name"));
  table.add(0x3F, write_by_name("V.G-write value by name"));
}

namespace {

using nc::VariableFamily;

constexpr std::uint32_t program_name_size = 96;

/// The variable whose index, from 0, is the input.
Result<nc::VariableInfo> by_index(VariableFamily family, const Context& at, BytesView in) {
  return decode_u32(in).and_then([&](std::uint32_t index) -> Result<nc::VariableInfo> {
    const auto info = at.channel->program_variables().info(family, index);
    return info ? Result<nc::VariableInfo>(*info) : tl::unexpected(ErrorCode::invalid_data);
  });
}

/// The name of an array has its largest index (IB/hmiviaads/15685595531, documented).
std::string listed_name(const nc::VariableInfo& info) {
  std::string name = info.name;
  for (const std::size_t size : info.shape.dimensions) {
    name += fmt::format("[{}]", size - 1);
  }
  return name;
}

Result<Bytes> name_of(const nc::VariableInfo& info) {
  return encode_buffer(listed_name(info), program_name_size);
}

/// A number as REAL64 (documented). A text of at most 20 characters in 24 bytes, as in the other
/// old functions (our choice).
Result<Bytes> old_value(const Context& at, std::string_view name) {
  const nc::run::Memory& variables = at.channel->program_variables();
  if (!variables.find(name)) {
    return tl::unexpected(at.machine.settings().answers.unknown_variable);
  }
  const auto value = variables.read(name);
  if (!value) {
    return tl::unexpected(ErrorCode::invalid_data);
  }
  if (const auto* const text = std::get_if<std::string>(&*value)) {
    return text->size() > old_text_characters ? tl::unexpected(ErrorCode::invalid_size)
                                              : encode_buffer(*text, old_value_size);
  }
  return encode_f64(std::get<double>(*value));
}

/// The four functions of a family; three of them have consecutive offsets.
void add_family(ObjectTable& table, std::string_view prefix, VariableFamily family,
                std::uint32_t number_offset, std::uint32_t name_offset) {
  table.add(number_offset,
            object(fmt::format("{}-number", prefix), "UNS32", "", [family](const Context& at) {
              return encode_u32(at.channel->program_variables().count(family));
            }));
  table.add(name_offset, {.name = fmt::format("{}-name by index", prefix),
                          .type = "STRING",
                          .length = program_name_size,
                          .exchange = [family](const Context& at, BytesView in) {
                            return by_index(family, at, in).and_then(name_of);
                          }});
  table.add(name_offset + 1, {.name = fmt::format("{}-value by name", prefix),
                              .type = "REAL64",
                              .length = 8,
                              .exchange = [](const Context& at, BytesView in) {
                                return decode_name(in).and_then(
                                    [&](std::string_view name) { return old_value(at, name); });
                              }});
  table.add(name_offset + 2,
            {.name = fmt::format("{}-value by index", prefix),
             .type = "REAL64",
             .length = 8,
             .exchange = [family](const Context& at, BytesView in) {
               return by_index(family, at, in).and_then([&](const nc::VariableInfo& info) {
                 // For an array, the element in its listed name (our choice).
                 return old_value(at, listed_name(info));
               });
             }});
}

}  // namespace

void add_old_program_variables(ObjectTable& table) {
  add_family(table, "P", VariableFamily::parameter, 0x02, 0x1B);
  add_family(table, "V.L", VariableFamily::local, 0x03, 0x1E);
  add_family(table, "V.P", VariableFamily::program, 0x04, 0x21);
  add_family(table, "V.S", VariableFamily::self, 0x05, 0x24);
}

}  // namespace millrace::cnc::simulator::objects
