#include "cnc/simulator/objects/old_variables.hpp"

#include <string>
#include <utility>

#include "cnc/simulator/objects/answers.hpp"
#include "cnc/simulator/objects/old_listing.hpp"
#include "cnc/simulator/objects/old_value.hpp"
#include "cnc/variables/text.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::ErrorCode;
using ads::Result;

/// Bytes of the buffers of names and descriptions (documented).
constexpr std::uint32_t long_text = 96;
constexpr std::uint32_t short_text = 20;
/// S_WRITE_VAR_DATA: the name, then the value. That the value is at 96 and not at 92 is inferred
/// from the documented size and the alignment of a REAL64.
constexpr std::size_t listed_name_size = 92;
constexpr std::size_t write_size = 120;

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
  const Listing all = list_externals();
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
  const Listing all = list_quantities();
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
  const Listing all = list_globals();
  table.add(0x39, count("V.G-max. number", all));
  table.add(0x3A, name_by_index("V.G-name by index", long_text, all));
  table.add(0x3B, text_by_index("V.G-type by index", long_text, all, type_text));
  table.add(0x3C, text_by_index("V.G-mode by index", long_text, all, mode_text));
  table.add(0x3D, text_by_index("V.G-node by index", long_text, all, node_text));
  table.add(0x3E, value_by_name("V.G-read value by name"));
  table.add(0x3F, write_by_name("V.G-write value by name"));
}

}  // namespace millrace::cnc::simulator::objects
