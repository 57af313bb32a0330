#include <algorithm>
#include <array>
#include <cctype>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "cnc/simulator/objects/tables.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"
#include "cnc/variables/value.hpp"

namespace millrace::cnc::simulator::objects {

namespace {

using ads::Bytes;
using ads::BytesView;
using ads::ErrorCode;
using ads::Result;

Result<nc::VariableInfo> find(const Context& at, std::string_view name) {
  const auto info = at.channel->program_variables().find(name);
  return info ? Result<nc::VariableInfo>(*info)
              : tl::unexpected(at.machine.settings().answers.unknown_variable);
}

/// "[0][0]" to "[i][j]", row by row; one empty text for a single value.
std::vector<std::string> index_texts(const std::vector<std::size_t>& dimensions) {
  std::vector<std::string> texts{""};
  for (const std::size_t size : dimensions) {
    std::vector<std::string> longer;
    for (const std::string& text : texts) {
      for (std::size_t index = 0; index < size; ++index) {
        longer.push_back(fmt::format("{}[{}]", text, index));
      }
    }
    texts = std::move(longer);
  }
  return texts;
}

/// The number of values that `name` selects.
std::size_t count_of(std::string_view name, const nc::VariableInfo& info) {
  const auto& sizes = info.shape.dimensions;
  return name == info.name
             ? std::accumulate(sizes.begin(), sizes.end(), std::size_t{1},
                               [](std::size_t product, std::size_t size) { return product * size; })
             : 1;
}

/// The names of the values that `name` selects: itself, or all elements of an array.
std::vector<std::string> elements_of(std::string_view name, const nc::VariableInfo& info) {
  if (name != info.name) {
    return {std::string(name)};
  }
  std::vector<std::string> names = index_texts(info.shape.dimensions);
  std::for_each(names.begin(), names.end(), [&](std::string& text) { text.insert(0, name); });
  return names;
}

/// True if a name begins with the family of a variable that NC programs create.
bool is_program_variable(std::string_view name) {
  constexpr std::array<std::string_view, 4> prefixes{"V.P.", "V.L.", "V.S.", "V.CYC."};
  const bool parameter =
      name.size() > 1 && name[0] == 'P' && std::isdigit(static_cast<unsigned char>(name[1])) != 0;
  return parameter || std::any_of(prefixes.begin(), prefixes.end(), [&](std::string_view prefix) {
           return name.starts_with(prefix);
         });
}

/// An element or a whole array. A name that does not exist at present gets the error of an unknown
/// variable; a value of the wrong size fails with invalid_size.
Result<Bytes> read_program_variable(const Context& at, std::string_view name) {
  const auto info = find(at, name);
  if (!info) {
    return tl::unexpected(info.error());
  }
  const ElementType type = element_of(info->shape);
  // The size is known before the first read, so a large array that does not fit costs no time.
  if (count_of(name, *info) * type.size > std::min<std::size_t>(at.room, variables::max_stream)) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  Bytes all;
  for (const std::string& element : elements_of(name, *info)) {
    const auto bytes = at.channel->program_variables().read(element).and_then(
        [&](const nc::Value& value) { return encode(type, value); });
    if (!bytes) {
      return tl::unexpected(at.machine.settings().answers.unknown_variable);  // no such element
    }
    all.insert(all.end(), bytes->begin(), bytes->end());
  }
  return all;
}

Result<void> write_program_variable(const Context& at, std::string_view name, BytesView value) {
  const auto info = find(at, name);
  if (!info) {
    return tl::unexpected(info.error());
  }
  const ElementType type = element_of(info->shape);
  const std::size_t count = count_of(name, *info);
  if (count > 1 && value.size() != count * type.size) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  const std::vector<std::string> elements = elements_of(name, *info);
  for (const std::string& element : elements) {
    const BytesView scalar = elements.size() > 1 ? value.first(type.size) : value;
    const auto accepted = accept(type, scalar);
    if (!accepted) {
      return tl::unexpected(accepted.error());
    }
    if (!at.channel->program_variables().overwrite(element, decode(type, *accepted))) {
      return tl::unexpected(at.machine.settings().answers.unknown_variable);  // no such element
    }
    value = value.subspan(scalar.size());
  }
  return {};
}

/// The description has no handle (0).
Result<variables::Description> describe_program_variable(const Context& at, std::string_view name) {
  return find(at, name).map([](const nc::VariableInfo& info) {
    const ElementType type = element_of(info.shape);
    variables::Description description{0, type.type, Access::read_write, type.size, {}, info.name};
    for (const std::size_t size : info.shape.dimensions) {
      description.dimensions.push_back(static_cast<std::uint32_t>(size));
      description.size *= static_cast<std::uint32_t>(size);
    }
    return description;
  });
}

using variables::NameInDescription;
namespace offset = variables::offset;

/// A numbered variable of one kind, or of all three kinds in a row; null if there is none.
struct Enumeration {
  const Store& store;
  /// "V.E", "V.G", "V.A", or empty for all.
  std::string_view kind;

  [[nodiscard]] bool valid() const {
    return kind.empty() || std::any_of(all_kinds.begin(), all_kinds.end(),
                                       [&](Kind candidate) { return includes(candidate); });
  }
  [[nodiscard]] bool includes(Kind candidate) const {
    return kind.empty() || kind == prefix_of(candidate);
  }

  [[nodiscard]] std::size_t size() const {
    std::size_t sum = 0;
    for (const Kind listed : all_kinds) {
      sum += includes(listed) ? store.family(listed).size() : 0;
    }
    return sum;
  }

  [[nodiscard]] const Variable* at(std::size_t index) const {
    for (const Kind listed : all_kinds) {
      if (!includes(listed)) {
        continue;
      }
      const Family& family = store.family(listed);
      if (index < family.size()) {
        return &family.at(index);
      }
      index -= family.size();
    }
    return nullptr;
  }
};

/// An array's name has no index, unless the index is in the middle of it (our choice).
std::string described_name(const Declaration& declaration) {
  return declaration.behind > 0 && !declaration.dimensions.empty() ? declaration.last_element()
                                                                   : declaration.name;
}

Bytes describe(const Store& store, const Variable& variable, NameInDescription with_name) {
  const Declaration& declaration = variable.declaration();
  return variables::encode(
      variables::Description{store.handle(declaration.name).value(), declaration.element.type,
                             declaration.access, declaration.size(), declaration.dimensions,
                             described_name(declaration)},
      with_name);
}

Result<Selection> find_element(const Context& at, const variables::ElementOf& element) {
  const auto found = at.channel->store().find(element.handle, element.indices);
  return found ? Result<Selection>(*found) : tl::unexpected(ErrorCode::invalid_data);
}

Result<Bytes> value_of(const Context& at, const Selection& selection) {
  const Declaration& declaration = selection.variable->declaration();
  // The size is known before the read.
  if (!selection.element &&
      declaration.size() > std::min<std::size_t>(at.room, variables::max_stream)) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  Bytes bytes = selection.read();
  const bool text = declaration.element.type == Type::string;
  if (text && selection.element && !at.machine.settings().answers.whole_string_buffer) {
    bytes.erase(std::find(bytes.begin(), bytes.end(), std::uint8_t{0}) + 1, bytes.end());
  }
  return bytes;
}

Result<Bytes> count_variables(const Context& at, BytesView in) {
  const std::string kind = variables::decode_text(in);
  const Enumeration variables{at.channel->store(), kind};
  if (!variables.valid()) {
    return tl::unexpected(ErrorCode::invalid_data);
  }
  return encode_u32(static_cast<std::uint32_t>(variables.size()));
}

/// The variable that the input of 0x45 and 0x4B selects.
Result<const Variable*> by_index(const Context& at, BytesView in) {
  const auto stream = variables::decode_index_stream(in);
  if (!stream) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  const Enumeration variables{at.channel->store(), stream->kind};
  const Variable* variable = variables.valid() ? variables.at(stream->index) : nullptr;
  return variable != nullptr ? Result<const Variable*>(variable)
                             : tl::unexpected(ErrorCode::invalid_data);
}

Result<Bytes> description_by_index(const Context& at, BytesView in) {
  return by_index(at, in).map([&](const Variable* variable) {
    return describe(at.channel->store(), *variable, NameInDescription::yes);
  });
}

Result<Bytes> description_by_name(const Context& at, BytesView in) {
  return decode_name(in).and_then([&](std::string_view name) -> Result<Bytes> {
    if (is_program_variable(name)) {
      return describe_program_variable(at, name).map([](const variables::Description& found) {
        return variables::encode(found, NameInDescription::no);
      });
    }
    return find_variable(at, name).map([&](const Selection& found) {
      return describe(at.channel->store(), *found.variable, NameInDescription::no);
    });
  });
}

/// Empty for V.G. and V.A. variables (documented).
Result<Bytes> extended_description(const Context& at, BytesView in) {
  return by_index(at, in).map([](const Variable* variable) {
    const auto& external = variable->declaration().external;
    return external
               ? ads::ByteWriter().u32(external->synchronisation()).u32(external->scope()).take()
               : Bytes{};
  });
}

Result<Bytes> handle_by_name(const Context& at, BytesView in) {
  return decode_name(in).and_then([&](std::string_view name) -> Result<Bytes> {
    const auto handle = at.channel->store().handle(name);
    return handle ? Result<Bytes>(encode_u32(*handle))
                  : tl::unexpected(at.machine.settings().answers.unknown_variable);
  });
}

Result<Bytes> read_by_handle(const Context& at, BytesView in) {
  const auto stream = variables::decode_handle_stream(in);
  if (!stream) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  return find_element(at, stream->element).and_then([&](const Selection& found) {
    return value_of(at, found);
  });
}

Result<Bytes> read_by_name(const Context& at, BytesView in) {
  return decode_name(in).and_then([&](std::string_view name) {
    return is_program_variable(name)
               ? read_program_variable(at, name)
               : find_variable(at, name).and_then(
                     [&](const Selection& found) { return value_of(at, found); });
  });
}

Result<void> write_by_handle(const Context& at, BytesView in) {
  const auto stream = variables::decode_handle_stream(in);
  if (!stream) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  return find_element(at, stream->element).and_then([&](const Selection& found) {
    return found.write(stream->value);
  });
}

Result<void> write_variable_by_name(const Context& at, BytesView in) {
  const auto stream = variables::decode_name(in);
  if (!stream) {
    return tl::unexpected(ErrorCode::invalid_size);
  }
  if (is_program_variable(stream->name)) {
    return write_program_variable(at, stream->name, stream->value);
  }
  return find_variable(at, stream->name).and_then([&](const Selection& found) {
    return found.write(stream->value);
  });
}

/// No stream is longer than 2048 bytes (documented).
Result<Bytes> limit(Result<Bytes> out) {
  return out && out->size() > variables::max_stream ? tl::unexpected(ErrorCode::invalid_size) : out;
}

void add_exchange(ObjectTable& table, std::uint32_t number, std::string name,
                  Object::Exchange exchange) {
  table.add(number, {.name = std::move(name),
                     .type = "STREAM",
                     .length = variables::max_stream,
                     .exchange = [exchange = std::move(exchange)](const Context& at, BytesView in) {
                       return in.size() > variables::max_stream
                                  ? tl::unexpected(ErrorCode::invalid_size)
                                  : limit(exchange(at, in));
                     }});
}

void add_write(ObjectTable& table, std::uint32_t number, std::string name, Object::Write write) {
  table.add(number, {.name = std::move(name),
                     .type = "STREAM",
                     .length = variables::max_stream,
                     .write = [write = std::move(write)](const Context& at, BytesView in) {
                       return in.size() > variables::max_stream
                                  ? tl::unexpected(ErrorCode::invalid_size)
                                  : write(at, in);
                     }});
}

}  // namespace

Object variable_by_handle() {
  const auto find = [](const Context& at) { return at.channel->store().find(at.offset, {}); };
  return {.name = "variable",
          .type = "STREAM",
          .length = variables::max_stream,
          .read = [find](const Context& at) { return value_of(at, *find(at)); },
          .write = [find](const Context& at, BytesView value) { return find(at)->write(value); }};
}

void add_generic_variables(ObjectTable& table) {
  add_exchange(table, offset::count, "number of variables", count_variables);
  add_exchange(table, offset::description_by_index, "description by index", description_by_index);
  add_exchange(table, offset::handle_by_name, "handle by name", handle_by_name);
  add_exchange(table, offset::read_by_handle, "read by handle", read_by_handle);
  add_exchange(table, offset::read_by_name, "read by name", read_by_name);
  add_write(table, offset::write_by_handle, "write by handle", write_by_handle);
  add_write(table, offset::write_by_name, "write by name", write_variable_by_name);
  add_exchange(table, offset::extended_description, "extended description", extended_description);
  add_exchange(table, offset::description_by_name, "description by name", description_by_name);
}

}  // namespace millrace::cnc::simulator::objects
