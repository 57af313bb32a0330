// The old functions of P, V.L, V.P and V.S.
#include <string>
#include <utility>

#include <fmt/format.h>

#include "cnc/simulator/objects/object.hpp"
#include "cnc/simulator/objects/old_variables.hpp"
#include "cnc/simulator/objects/program_variables.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::BytesView;
using ads::ErrorCode;
using ads::Result;
using nc::VariableFamily;

constexpr std::uint32_t program_name_size = 96;

Result<Bytes> number(VariableFamily family, const Context& at) {
  return encode_u32(static_cast<std::uint32_t>(at.channel->program_variables().count(family)));
}

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
  const nc::VariableDirectory& variables = at.channel->program_variables();
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
  table.add(number_offset, {.name = fmt::format("{}-number", prefix),
                            .type = "UNS32",
                            .length = 4,
                            .read = [family](const Context& at) { return number(family, at); }});
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
