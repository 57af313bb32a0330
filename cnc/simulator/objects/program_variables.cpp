#include "cnc/simulator/objects/program_variables.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <numeric>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "cnc/variables/addresses.hpp"

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

}  // namespace

bool is_program_variable(std::string_view name) {
  constexpr std::array<std::string_view, 4> prefixes{"V.P.", "V.L.", "V.S.", "V.CYC."};
  const bool parameter =
      name.size() > 1 && name[0] == 'P' && std::isdigit(static_cast<unsigned char>(name[1])) != 0;
  return parameter || std::any_of(prefixes.begin(), prefixes.end(), [&](std::string_view prefix) {
           return name.starts_with(prefix);
         });
}

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
    const BytesView one = elements.size() > 1 ? value.first(type.size) : value;
    const auto accepted = accept(type, one);
    if (!accepted) {
      return tl::unexpected(accepted.error());
    }
    if (!at.channel->program_variables().overwrite(element, decode(type, *accepted))) {
      return tl::unexpected(at.machine.settings().answers.unknown_variable);  // no such element
    }
    value = value.subspan(one.size());
  }
  return {};
}

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

}  // namespace millrace::cnc::simulator::objects
